/* What the requests for modem lines return on a port, good ones and bad ones, a line for each. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *path;

static void say(const char *what, int result, const void *value)
{
    if (result == 0 && value)
        printf("%s %x\n", what, *(const unsigned *)value);
    else if (result == 0)
        printf("%s done\n", what);
    else
        printf("%s: %s\n", what, strerror(errno));
}

static int other_process(int port)
{
    int status, lines = 0;
    pid_t child = fork();
    if (child == 0)
        _exit(ioctl(port, TIOCMGET, &lines) != 0 || !(lines & TIOCM_DSR));
    waitpid(child, &status, 0);
    return WEXITSTATUS(status);
}

static void *other_thread(void *port)
{
    static int lines;
    return ioctl(*(int *)port, TIOCMGET, &lines) == 0 ? &lines : NULL;
}

int main(int argc, char **argv)
{
    int lines = 0, bits = TIOCM_RTS, port;
    unsigned state = 0;
    pthread_t thread;
    void *answer;
    struct serial_struct settings;
    struct serial_icounter_struct counts;

    path = argv[argc - 1];
    port = open(path, O_RDWR | O_NOCTTY);
    say("TIOCMGET", ioctl(port, TIOCMGET, &lines), &lines);
    if (errno == ENOTTY)
        return 1;
    say("TIOCMBIC", ioctl(port, TIOCMBIC, &bits), NULL);
    say("TIOCMGET", ioctl(port, TIOCMGET, &lines), &lines);
    say("TIOCMBIS", ioctl(port, TIOCMBIS, &bits), NULL);
    bits = TIOCM_DTR;
    say("TIOCMSET", ioctl(port, TIOCMSET, &bits), NULL);
    say("TIOCMGET", ioctl(port, TIOCMGET, &lines), &lines);
    memset(&counts, 0xAA, sizeof counts);
    say("TIOCGICOUNT", ioctl(port, TIOCGICOUNT, &counts), &counts.cts);
    say("changes of DSR", 0, &counts.dsr);
    say("errors", 0, &counts.reserved[8]);
    memset(&settings, 0xAA, sizeof settings);
    say("TIOCGSERIAL", ioctl(port, TIOCGSERIAL, &settings), &settings.type);
    say("baud base", 0, &settings.baud_base);
    settings.flags |= ASYNC_LOW_LATENCY;
    settings.custom_divisor = 0x30;
    say("TIOCSSERIAL", ioctl(port, TIOCSSERIAL, &settings), NULL);
    memset(&settings, 0, sizeof settings);
    say("TIOCGSERIAL", ioctl(port, TIOCGSERIAL, &settings), &settings.flags);
    say("divisor", 0, &settings.custom_divisor);
    say("TIOCSERGETLSR", ioctl(port, TIOCSERGETLSR, &state), &state);

    say("null", ioctl(port, TIOCMGET, (void *)8), NULL);
    say("beyond", ioctl(port, TIOCMSET, (void *)-8L), NULL);
    say("constant", ioctl(port, TIOCMGET, "constant"), NULL);
    say("counts nowhere", ioctl(port, TIOCGICOUNT, (void *)8), NULL);
    say("settings nowhere", ioctl(port, TIOCSSERIAL, (void *)8), NULL);
    say("none", ioctl(-1, TIOCMGET, &lines), NULL);
    say("huge", ioctl(0x7FFFFFFF, TIOCMGET, &lines), NULL);
    say("closed", ioctl(900, TIOCMGET, &lines), NULL);
    say("by name only", ioctl(open(path, O_PATH), TIOCMGET, &lines), NULL);
    lines = 0;
    say("for requests only", ioctl(open(path, 3 | O_NOCTTY), TIOCMGET, &lines), &lines);
    say("copy", ioctl(dup2(port, 700), TIOCMGET, &lines), &lines);
    say("null device", ioctl(open("/dev/null", O_RDWR), TIOCMGET, &lines), NULL);
    say("pipe", ioctl(fileno(popen("true", "r")), TIOCMGET, &lines), NULL);
    say("other terminal", ioctl(posix_openpt(O_RDWR | O_NOCTTY), TIOCMGET, &lines), NULL);
    say("another request", ioctl(port, 0x54FF, &lines), NULL);
    say("another process", other_process(port), NULL);
    pthread_create(&thread, NULL, other_thread, &port);
    pthread_join(thread, &answer);
    say("another thread", answer == NULL, NULL);
    return 0;
}
