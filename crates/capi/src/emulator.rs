//! A controller, and what can be done with it.

use std::ffi::{CString, c_char};
use std::ptr;
use std::time::Duration;

use vimc4::{Order, read_condition};

use crate::error::{Failure, guarded};
use crate::options;
use crate::text::{of_caller, to_caller};

/// A controller that runs.
#[derive(Debug)]
pub struct Emulator {
    pub(crate) emulator: vimc4::Emulator,
    /// Where it can be reached, as texts that live as long as it does.
    port: Option<CString>,
    tcp: Option<CString>,
    rfc2217: Option<CString>,
}

/// What a controller was at one moment.
#[derive(Debug)]
pub struct Snapshot(vimc4::Snapshot);

/// The controller behind a pointer.
///
/// # Safety
///
/// The pointer is one that `vimc4_start` has returned and that was not stopped yet, or NULL.
pub(crate) unsafe fn controller<'a>(emulator: *const Emulator) -> Result<&'a Emulator, Failure> {
    // SAFETY: the caller says that it is NULL or a box of `vimc4_start` that is still alive, and nothing
    // ever makes a unique reference to what is in it.
    unsafe { emulator.as_ref() }.ok_or_else(|| Failure::new("the controller is NULL"))
}

/// Starts a controller and returns it, or NULL. `options` is an array of texts KEY=VALUE with a NULL behind
/// the last one, or NULL for none:
///
/// model=NAME|FILE      imc4 if nothing is said; `vimc4 models` lists them
/// machine=NAME|FILE    bench if nothing is said; `vimc4 machines` lists them
/// time=CLOCK           real (if nothing is said), 8x, instant or manual
/// pty=LINK             a pseudo-terminal with this link; `any` for one without
/// tcp=ADDR             listens there; port 0 picks a free one
/// rfc2217=ADDR         the same for clients that speak RFC 2217
/// serial=DEVICE        a real serial port
/// flash=FILE           keeps the flash memory there
/// record=FILE          records everything into this file
/// line_pacing=on|off   whether characters take their time on the line
/// fresh_clients=on|off whether the half line of a client that has left is forgotten
/// replace_link=on|off  whether the link is taken even from an emulator that is running
/// tcp_clients=POLICY   refuse, takeover or observe
///
/// # Safety
///
/// `options` is NULL or an array as described.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_start(options: *const *const c_char) -> *mut Emulator {
    guarded(ptr::null_mut(), || {
        // SAFETY: the caller says that it is NULL or an array of texts that ends with NULL.
        let options = unsafe { options::of_caller(options) }?;
        let emulator = options::builder(&options)?.start()?;
        let text = |place: Option<String>| place.and_then(|place| CString::new(place).ok());
        let (tcp, rfc2217) = (emulator.tcp_addr(), emulator.rfc2217_addr());
        Ok(Box::into_raw(Box::new(Emulator {
            port: text(emulator.port().map(|path| path.to_string_lossy().into_owned())),
            tcp: text(tcp.map(|address| address.to_string())),
            rfc2217: text(rfc2217.map(|address| address.to_string())),
            emulator,
        })))
    })
}

/// Ends a controller and removes its link. NULL is nothing to be ended.
///
/// # Safety
///
/// `emulator` is NULL or one that was not stopped yet, and no other function is at work with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_stop(emulator: *mut Emulator) {
    guarded((), || {
        if !emulator.is_null() {
            // SAFETY: the caller says that it is a box of `vimc4_start` that nobody uses any more.
            drop(unsafe { Box::from_raw(emulator) });
        }
        Ok(())
    });
}

/// A text of a controller that lives as long as it does.
fn place(text: Option<&CString>, none: &str) -> Result<*const c_char, Failure> {
    text.map(|text| text.as_ptr()).ok_or_else(|| Failure::new(none))
}

/// The path of the serial port that a program opens: the link, or the pseudo-terminal itself. NULL if there
/// is none. The text lives as long as the controller.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_port(emulator: *const Emulator) -> *const c_char {
    guarded(ptr::null(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        place(
            emulator.port.as_ref(),
            "it has no pseudo-terminal; start it with pty=any or pty=LINK",
        )
    })
}

/// Where it listens, as in 127.0.0.1:4004. NULL if it does not. The text lives as long as the controller.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_tcp(emulator: *const Emulator) -> *const c_char {
    guarded(ptr::null(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        place(emulator.tcp.as_ref(), "it does not listen; start it with tcp=127.0.0.1:0")
    })
}

/// Where it listens for clients that speak RFC 2217. NULL if it does not. The text lives as long as the
/// controller.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_rfc2217(emulator: *const Emulator) -> *const c_char {
    guarded(ptr::null(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        place(emulator.rfc2217.as_ref(), "it does not listen; start it with rfc2217=127.0.0.1:0")
    })
}

/// Nanoseconds as C takes them.
fn nanoseconds(at: vimc4::Time) -> i64 {
    i64::try_from(at.as_nanos()).unwrap_or(i64::MAX)
}

/// The controller's time in nanoseconds since it was started.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_now(emulator: *const Emulator) -> i64 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        Ok(nanoseconds(emulator.emulator.now()?))
    })
}

/// Lets so many nanoseconds pass, with time=manual at once, and returns the time.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_advance(emulator: *const Emulator, nanoseconds_more: u64) -> i64 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        Ok(nanoseconds(emulator.emulator.advance(Duration::from_nanos(nanoseconds_more))?))
    })
}

/// Waits until something is so, as in `x = 2500`, `idle` or `answer error 2`, and returns the time at which it
/// was. It fails where it can never come.
///
/// # Safety
///
/// `emulator` was started and not stopped yet; `condition` is a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_run_until(
    emulator: *const Emulator,
    condition: *const c_char,
) -> i64 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        // SAFETY: as this function asks for.
        let condition = unsafe { of_caller(condition, "the condition") }?;
        let condition =
            read_condition(condition, &emulator.emulator.names()?).map_err(Failure::of)?;
        Ok(nanoseconds(emulator.emulator.run_until(&condition)?))
    })
}

/// Carries out an order, as typed at `vimc4 serve`: `press stop`, `cover open`, `input 0.3 1`, `power off`,
/// `help`. Returns what it says, to be freed with vimc4_free, or NULL.
///
/// # Safety
///
/// `emulator` was started and not stopped yet; `order` is a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_order(
    emulator: *const Emulator,
    order: *const c_char,
) -> *mut c_char {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        // SAFETY: as this function asks for.
        let order = unsafe { of_caller(order, "the order") }?;
        let read = Order::read(order, &emulator.emulator.names()?).map_err(Failure::of)?;
        let read = read.ok_or_else(|| Failure::new("the order is empty; help lists them"))?;
        if read == Order::Quit {
            return Err(Failure::new("a controller is ended with vimc4_stop"));
        }
        to_caller(emulator.emulator.give(&read)?)
    })
}

/// Sets a signal by name, as in `stop`, `cover` or `input 0.3`; `signals` as an order lists them with their
/// values. Returns 0.
///
/// # Safety
///
/// `emulator` was started and not stopped yet; `signal` is a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_set_signal(
    emulator: *const Emulator,
    signal: *const c_char,
    value: i32,
) -> i32 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        // SAFETY: as this function asks for.
        let signal = unsafe { of_caller(signal, "the signal") }?;
        emulator.emulator.set_signal(signal, value)?;
        Ok(0)
    })
}

/// Writes the counters of the axes, in steps, and returns how many axes there are; no more than `count` are
/// written.
///
/// # Safety
///
/// `emulator` was started and not stopped yet; `steps` has room for `count` numbers, or is NULL and `count` 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_position(
    emulator: *const Emulator,
    steps: *mut i64,
    count: usize,
) -> i32 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        let position = emulator.emulator.position()?;
        if steps.is_null() && count > 0 {
            return Err(Failure::new("there is room for positions, but it is NULL"));
        }
        let written = position.len().min(count);
        if written > 0 {
            // SAFETY: there is room for `count` numbers, which is no less than are written, and it is not a memory
            // of ours.
            unsafe { ptr::copy_nonoverlapping(position.as_ptr(), steps, written) };
        }
        Ok(i32::try_from(position.len()).unwrap_or(i32::MAX))
    })
}

/// What a person would see of the controller: axes, ports, signals, program, timers; as JSON, to be freed with
/// vimc4_free.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_view(emulator: *const Emulator) -> *mut c_char {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        to_caller(serde_json::to_string(&emulator.emulator.view()?).map_err(Failure::of)?)
    })
}

/// The commands that the host has sent since the start or vimc4_forget, at most the last 100,000: a JSON array
/// of objects with `at` (nanoseconds), `number`, `mnemonic`, `line` and `text`, to be freed with vimc4_free.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_commands(emulator: *const Emulator) -> *mut c_char {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        let commands = emulator.emulator.commands()?;
        let each = commands.iter().map(|command| {
            serde_json::json!({
                "at": command.at,
                "number": command.number,
                "mnemonic": command.mnemonic,
                "line": vimc4::escape(&command.bytes),
                "text": command.text,
            })
        });
        to_caller(serde_json::Value::from_iter(each).to_string())
    })
}

/// What has happened since the start or vimc4_forget, at most the last 100,000 events: a JSON array of objects
/// with `at` (nanoseconds), `command` (the number of the command it belongs to) and `event`, to be freed with
/// vimc4_free.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_events(emulator: *const Emulator) -> *mut c_char {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        let events = emulator.emulator.events()?;
        let each = events.iter().map(|(stamp, event)| {
            serde_json::json!({ "at": stamp.at, "command": stamp.command, "event": event })
        });
        to_caller(serde_json::Value::from_iter(each).to_string())
    })
}

/// Forgets the commands and events up to now. Returns 0.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_forget(emulator: *const Emulator) -> i32 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        emulator.emulator.forget()?;
        Ok(0)
    })
}

/// Keeps what the controller is now, to go on from there as often as wanted. To be freed with
/// vimc4_snapshot_free.
///
/// # Safety
///
/// `emulator` was started and not stopped yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_snapshot_take(emulator: *const Emulator) -> *mut Snapshot {
    guarded(ptr::null_mut(), || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        Ok(Box::into_raw(Box::new(Snapshot(emulator.emulator.snapshot()?))))
    })
}

/// Lets a controller of the same model and machine go on from what was kept. A snapshot of another model or
/// machine is refused. Returns 0.
///
/// # Safety
///
/// `emulator` was started and not stopped yet; `snapshot` was taken and not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_restore(
    emulator: *const Emulator,
    snapshot: *const Snapshot,
) -> i32 {
    guarded(-1, || {
        // SAFETY: as this function asks for.
        let emulator = unsafe { controller(emulator) }?;
        // SAFETY: the caller says that it is NULL or a box of `vimc4_snapshot_take` that is still alive.
        let snapshot = unsafe { snapshot.as_ref() };
        let snapshot = snapshot.ok_or_else(|| Failure::new("the snapshot is NULL"))?;
        emulator.emulator.restore(&snapshot.0)?;
        Ok(0)
    })
}

/// Frees a snapshot. NULL is nothing to be freed.
///
/// # Safety
///
/// `snapshot` is NULL, or was taken and not freed yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vimc4_snapshot_free(snapshot: *mut Snapshot) {
    guarded((), || {
        if !snapshot.is_null() {
            // SAFETY: the caller says that it is a box of `vimc4_snapshot_take` that nobody uses any more.
            drop(unsafe { Box::from_raw(snapshot) });
        }
        Ok(())
    });
}
