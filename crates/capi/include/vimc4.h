/* Virtual stepper controllers of isel and LPKF, for tests of programs that drive them.
 *
 * This file is made from the sources of crates/capi.
 *
 * Texts are UTF-8 and end with a zero byte. Whatever returns a pointer returns NULL where it fails, and
 * whatever returns a number a negative one; vimc4_last_error says why. All functions of one controller may
 * be called from several threads at once, but not while or after it is stopped; a line and a snapshot are
 * for one thread at a time. */

#ifndef VIMC4_H
#define VIMC4_H

#include <stddef.h>
#include <stdint.h>

// A controller that runs.
typedef struct vimc4_emulator vimc4_emulator;

// A line to a controller, as a serial port that is open.
typedef struct vimc4_line vimc4_line;

// What a controller was at one moment.
typedef struct vimc4_snapshot vimc4_snapshot;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Starts a controller and returns it, or NULL. `options` is an array of texts KEY=VALUE with a NULL behind
// the last one, or NULL for none:
//
// model=NAME|FILE      imc4 if nothing is said; `vimc4 models` lists them
// machine=NAME|FILE    bench if nothing is said; `vimc4 machines` lists them
// time=CLOCK           real (if nothing is said), 8x, instant or manual
// pty=LINK             a pseudo-terminal with this link; `any` for one without
// tcp=ADDR             listens there; port 0 picks a free one
// rfc2217=ADDR         the same for clients that speak RFC 2217
// serial=DEVICE        a real serial port
// flash=FILE           keeps the flash memory there
// record=FILE          records everything into this file
// line_pacing=on|off   whether characters take their time on the line
// fresh_clients=on|off whether the half line of a client that has left is forgotten
// replace_link=on|off  whether the link is taken even from an emulator that is running
// tcp_clients=POLICY   refuse, takeover or observe
//
// # Safety
//
// `options` is NULL or an array as described.
vimc4_emulator *vimc4_start(const char *const *options);

// Ends a controller and removes its link. NULL is nothing to be ended.
//
// # Safety
//
// `emulator` is NULL or one that was not stopped yet, and no other function is at work with it.
void vimc4_stop(vimc4_emulator *emulator);

// The path of the serial port that a program opens: the link, or the pseudo-terminal itself. NULL if there
// is none. The text lives as long as the controller.
//
// # Safety
//
// `emulator` was started and not stopped yet.
const char *vimc4_port(const vimc4_emulator *emulator);

// Where it listens, as in 127.0.0.1:4004. NULL if it does not. The text lives as long as the controller.
//
// # Safety
//
// `emulator` was started and not stopped yet.
const char *vimc4_tcp(const vimc4_emulator *emulator);

// Where it listens for clients that speak RFC 2217. NULL if it does not. The text lives as long as the
// controller.
//
// # Safety
//
// `emulator` was started and not stopped yet.
const char *vimc4_rfc2217(const vimc4_emulator *emulator);

// The controller's time in nanoseconds since it was started.
//
// # Safety
//
// `emulator` was started and not stopped yet.
int64_t vimc4_now(const vimc4_emulator *emulator);

// Lets so many nanoseconds pass, with time=manual at once, and returns the time.
//
// # Safety
//
// `emulator` was started and not stopped yet.
int64_t vimc4_advance(const vimc4_emulator *emulator, uint64_t nanoseconds_more);

// Waits until something is so, as in `x = 2500`, `idle` or `answer error 2`, and returns the time at which it
// was. It fails where it can never come.
//
// # Safety
//
// `emulator` was started and not stopped yet; `condition` is a text.
int64_t vimc4_run_until(const vimc4_emulator *emulator,
                        const char *condition);

// Carries out an order, as typed at `vimc4 serve`: `press stop`, `cover open`, `input 0.3 1`, `power off`,
// `help`. Returns what it says, to be freed with vimc4_free, or NULL.
//
// # Safety
//
// `emulator` was started and not stopped yet; `order` is a text.
char *vimc4_order(const vimc4_emulator *emulator,
                  const char *order);

// Sets a signal by name, as in `stop`, `cover` or `input 0.3`; `signals` as an order lists them with their
// values. Returns 0.
//
// # Safety
//
// `emulator` was started and not stopped yet; `signal` is a text.
int32_t vimc4_set_signal(const vimc4_emulator *emulator,
                         const char *signal,
                         int32_t value);

// Writes the counters of the axes, in steps, and returns how many axes there are; no more than `count` are
// written.
//
// # Safety
//
// `emulator` was started and not stopped yet; `steps` has room for `count` numbers, or is NULL and `count` 0.
int32_t vimc4_position(const vimc4_emulator *emulator,
                       int64_t *steps,
                       size_t count);

// What a person would see of the controller: axes, ports, signals, program, timers; as JSON, to be freed with
// vimc4_free.
//
// # Safety
//
// `emulator` was started and not stopped yet.
char *vimc4_view(const vimc4_emulator *emulator);

// The commands that the host has sent since the start or vimc4_forget, at most the last 100,000: a JSON array
// of objects with `at` (nanoseconds), `number`, `mnemonic`, `line` and `text`, to be freed with vimc4_free.
//
// # Safety
//
// `emulator` was started and not stopped yet.
char *vimc4_commands(const vimc4_emulator *emulator);

// What has happened since the start or vimc4_forget, at most the last 100,000 events: a JSON array of objects
// with `at` (nanoseconds), `command` (the number of the command it belongs to) and `event`, to be freed with
// vimc4_free.
//
// # Safety
//
// `emulator` was started and not stopped yet.
char *vimc4_events(const vimc4_emulator *emulator);

// Forgets the commands and events up to now. Returns 0.
//
// # Safety
//
// `emulator` was started and not stopped yet.
int32_t vimc4_forget(const vimc4_emulator *emulator);

// Keeps what the controller is now, to go on from there as often as wanted. To be freed with
// vimc4_snapshot_free.
//
// # Safety
//
// `emulator` was started and not stopped yet.
vimc4_snapshot *vimc4_snapshot_take(const vimc4_emulator *emulator);

// Lets a controller of the same model and machine go on from what was kept. A snapshot of another model or
// machine is refused. Returns 0.
//
// # Safety
//
// `emulator` was started and not stopped yet; `snapshot` was taken and not freed yet.
int32_t vimc4_restore(const vimc4_emulator *emulator,
                      const vimc4_snapshot *snapshot);

// Frees a snapshot. NULL is nothing to be freed.
//
// # Safety
//
// `snapshot` is NULL, or was taken and not freed yet.
void vimc4_snapshot_free(vimc4_snapshot *snapshot);

// Why the last call of this thread that has failed did so; an empty text if none has. It is good until the
// next call that fails.
const char *vimc4_last_error(void);

// Frees a text that a function has returned to be freed. NULL is nothing to be freed.
//
// # Safety
//
// `text` is NULL, or was returned to be freed and was not freed yet.
void vimc4_free(char *text);

// Opens the line from within the process: a serial port without an operating system. To be closed with
// vimc4_line_close; it may outlive the controller.
//
// # Safety
//
// `emulator` was started and not stopped yet.
vimc4_line *vimc4_connect(const vimc4_emulator *emulator);

// Closes a line. NULL is nothing to be closed.
//
// # Safety
//
// `line` is NULL, or was connected and not closed yet, and no other function is at work with it.
void vimc4_line_close(vimc4_line *line);

// Reads what the controller has sent, at most `count` bytes, and waits for the first one so many milliseconds
// of wall time. Returns how many bytes they are; 0 when the time is over or the controller has ended.
//
// # Safety
//
// `line` was connected and not closed yet; `bytes` has room for `count` bytes.
ptrdiff_t vimc4_line_read(vimc4_line *line,
                          uint8_t *bytes,
                          size_t count,
                          uint32_t milliseconds);

// Sends bytes to the controller, and waits so many milliseconds of wall time where it takes none. Returns how
// many were sent: all, or fewer when the time is over.
//
// # Safety
//
// `line` was connected and not closed yet; `bytes` are `count` bytes.
ptrdiff_t vimc4_line_write(vimc4_line *line,
                           const uint8_t *bytes,
                           size_t count,
                           uint32_t milliseconds);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* VIMC4_H */
