/* A test in C with the controller in the same process: STOP is pressed in the middle of a move, and the
 * software under test has to notice. Here the software is three lines; yours opens vimc4_port() or
 * vimc4_tcp(), or reads and writes the line as this does. */

#include <stdio.h>
#include <string.h>

#include <vimc4.h>

static int failed(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, vimc4_last_error());
    return 1;
}

int main(void)
{
    const char *options[] = {"model=imc4", "time=manual", NULL};
    const char *commands = "@01\r@0A5000,900\r";
    uint8_t answers[2];
    int64_t x;

    vimc4_emulator *emulator = vimc4_start(options);
    if (!emulator)
        return failed("cannot start");
    vimc4_line *line = vimc4_connect(emulator);
    if (!line || vimc4_line_write(line, (const uint8_t *)commands, strlen(commands), 1000) < 0)
        return failed("cannot send");

    /* Time stands still but for what is asked for here, so this is step 2,500 exactly. */
    if (vimc4_run_until(emulator, "x = 2500") < 0)
        return failed("it does not get there");
    vimc4_free(vimc4_order(emulator, "press stop"));
    if (vimc4_run_until(emulator, "idle") < 0)
        return failed("it does not stop");

    for (int i = 0; i < 2; i++)
        if (vimc4_line_read(line, answers + i, 1, 1000) != 1)
            return failed("no answer");
    if (vimc4_position(emulator, &x, 1) < 0)
        return failed("no position");
    printf("answers %c%c at step %d\n", answers[0], answers[1], (int)x);

    vimc4_line_close(line);
    vimc4_stop(emulator);
    return 0;
}
