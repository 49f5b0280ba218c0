/* A host in C with its controller in the same process: a stop at step 2,500, and what goes wrong. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vimc4.h"

#define CHECK(what)                                                                     \
    do {                                                                                \
        if (!(what)) {                                                                  \
            fprintf(stderr, "line %d: %s: %s\n", __LINE__, #what, vimc4_last_error());  \
            exit(1);                                                                    \
        }                                                                               \
    } while (0)

static void send(vimc4_line *line, const char *text)
{
    CHECK(vimc4_line_write(line, (const uint8_t *)text, strlen(text), 1000) ==
          (ptrdiff_t)strlen(text));
}

static char answer(vimc4_line *line)
{
    uint8_t byte = 0;
    CHECK(vimc4_line_read(line, &byte, 1, 10000) == 1);
    return (char)byte;
}

/* It fails, and says why. */
static void says(const char *why)
{
    if (!strstr(vimc4_last_error(), why)) {
        fprintf(stderr, "instead of \"%s\": %s\n", why, vimc4_last_error());
        exit(1);
    }
}

int main(void)
{
    const char *options[] = {"model=imc4", "time=manual", "pty=./x.pty", "tcp=127.0.0.1:0", NULL};
    const char *wrong[] = {"model=imc5", NULL};
    const char *unknown[] = {"modell=imc4", NULL};
    const char *bare[] = {"model", NULL};
    const char *clock[] = {"time=soon", NULL};
    const char *another[] = {"model=imc-s8", "time=manual", NULL};
    int64_t steps[8] = {0};
    uint8_t byte;
    char *text;

    vimc4_emulator *emulator = vimc4_start(options);
    CHECK(emulator);
    CHECK(strstr(vimc4_port(emulator), "/x.pty"));
    CHECK(strncmp(vimc4_tcp(emulator), "127.0.0.1:", 10) == 0);
    CHECK(!vimc4_rfc2217(emulator));
    says("rfc2217=127.0.0.1:0");

    vimc4_line *line = vimc4_connect(emulator);
    CHECK(line);
    send(line, "@01\r");
    CHECK(answer(line) == '0');
    vimc4_snapshot *fresh = vimc4_snapshot_take(emulator);
    CHECK(fresh);

    /* A stop at step 2,500. */
    send(line, "@0A5000,900\r");
    CHECK(vimc4_run_until(emulator, "x = 2500") > 2500000000);
    CHECK(vimc4_position(emulator, steps, 8) == 4);
    CHECK((text = vimc4_order(emulator, "press stop")) && strcmp(text, "ok") == 0);
    vimc4_free(text);
    printf("%d\n", (int)steps[0]);
    CHECK(vimc4_run_until(emulator, "idle") > 0);
    CHECK(answer(line) == 'F');
    CHECK(vimc4_position(emulator, NULL, 0) == 4);

    CHECK((text = vimc4_commands(emulator)) && strstr(text, "\"line\":\"@0A5000,900\""));
    vimc4_free(text);
    CHECK((text = vimc4_events(emulator)) && strstr(text, "answer"));
    vimc4_free(text);
    CHECK((text = vimc4_view(emulator)) && strstr(text, "\"axes\""));
    vimc4_free(text);
    CHECK(vimc4_forget(emulator) == 0);
    CHECK((text = vimc4_commands(emulator)) && strcmp(text, "[]") == 0);
    vimc4_free(text);

    CHECK(vimc4_restore(emulator, fresh) == 0);
    CHECK(vimc4_position(emulator, steps, 1) == 4 && steps[0] == 0);
    CHECK(vimc4_advance(emulator, 1000) == vimc4_now(emulator));
    CHECK(vimc4_set_signal(emulator, "cover", 1) == 0);

    /* Time stands still: nothing comes, and that is not a failure. */
    CHECK(vimc4_line_read(line, &byte, 1, 10) == 0);

    /* What is wrong is said. */
    CHECK(!vimc4_start(wrong));
    says("imc4");
    CHECK(!vimc4_start(unknown));
    says("there is no option `modell`; there are model,");
    CHECK(!vimc4_start(bare));
    says("write KEY=VALUE");
    CHECK(!vimc4_start(clock));
    says("time=soon");
    CHECK(!vimc4_order(emulator, "press"));
    says("press");
    CHECK(!vimc4_order(emulator, ""));
    says("empty");
    CHECK(!vimc4_order(emulator, "quit"));
    says("vimc4_stop");
    CHECK(!vimc4_order(emulator, NULL));
    says("the order is NULL");
    CHECK(!vimc4_order(emulator, "press \xff"));
    says("UTF-8");
    CHECK(vimc4_run_until(emulator, "q = 1") < 0);
    says("q");
    CHECK(vimc4_set_signal(emulator, "nothing", 1) == -1);
    says("nothing");
    CHECK(vimc4_position(emulator, NULL, 3) == -1);
    says("NULL");
    CHECK(vimc4_now(NULL) == -1);
    says("the controller is NULL");
    vimc4_emulator *other = vimc4_start(another);
    CHECK(other && vimc4_restore(other, fresh) == -1);
    says("this is a state of imc4 on bench, and this controller is imc-s8 on bench");
    vimc4_stop(other);
    CHECK(!vimc4_connect(NULL) && !vimc4_view(NULL) && vimc4_restore(emulator, NULL) == -1);
    CHECK(vimc4_line_write(NULL, &byte, 1, 0) == -1 && vimc4_line_read(line, NULL, 1, 0) == -1);
    CHECK(vimc4_line_read(line, NULL, 0, 0) == 0 && vimc4_line_write(line, NULL, 0, 0) == 0);

    /* A line may outlive its controller. */
    vimc4_stop(emulator);
    CHECK(vimc4_line_read(line, &byte, 1, 10000) == 0);
    CHECK(vimc4_line_write(line, &byte, 1, 0) == -1);
    says("has ended");
    vimc4_line_close(line);
    vimc4_snapshot_free(fresh);
    vimc4_stop(NULL);
    vimc4_line_close(NULL);
    vimc4_snapshot_free(NULL);
    vimc4_free(NULL);

    emulator = vimc4_start(NULL);
    CHECK(emulator);
    CHECK(!vimc4_port(emulator));
    vimc4_stop(emulator);
    return 0;
}
