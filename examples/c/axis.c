/* Moves the X axis of an isel controller: `axis PORT STEPS SPEED`, as in
 * `axis /dev/ttyUSB0 4000 900` for 4,000 steps at 900 steps a second.
 *
 * It needs nothing but POSIX and knows nothing of virtual controllers. It ends with 0 if the
 * axis has moved, with 1 if the controller says otherwise or nothing, with 2 if it was called
 * wrongly or the port cannot be used. */

#define _DEFAULT_SOURCE /* cfmakeraw is in every libc, but not in POSIX */

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

static void fail(int code, const char *what, const char *why)
{
    fprintf(stderr, "axis: %s: %s\n", what, why);
    exit(code);
}

/* Opens a serial port with 19200 baud, 8N1, every byte as it is. */
static int open_port(const char *path)
{
    struct termios mode;
    /* Without O_NONBLOCK opening a real port may wait for a modem that is not there. */
    int port = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (port < 0 || tcgetattr(port, &mode) < 0)
        fail(2, path, strerror(errno));
    cfmakeraw(&mode);
    mode.c_cflag |= CLOCAL | CREAD;
    mode.c_cflag &= ~(tcflag_t)(CSTOPB | PARENB);
    cfsetispeed(&mode, B19200);
    cfsetospeed(&mode, B19200);
    if (tcsetattr(port, TCSANOW, &mode) < 0 || tcflush(port, TCIOFLUSH) < 0)
        fail(2, path, strerror(errno));
    return port;
}

/* Reads so many bytes, and waits this many milliseconds for each. */
static void receive(int port, char *bytes, size_t count, int timeout, const char *command)
{
    while (count > 0) {
        struct pollfd wait = {.fd = port, .events = POLLIN};
        int ready = poll(&wait, 1, timeout);
        ssize_t got = ready > 0 ? read(port, bytes, count) : ready;
        if (got < 0 && (errno == EINTR || errno == EAGAIN))
            continue;
        if (got < 0)
            fail(2, "the port failed", strerror(errno));
        if (got == 0)
            fail(1, command, ready ? "the port was closed" : "no answer; is the controller on?");
        bytes += got;
        count -= (size_t)got;
    }
}

static const char *meaning(char code)
{
    switch (code) {
    case '1': return "a number is out of range (1)";
    case '2': return "a limit switch was reached (2)";
    case '4': return "no axes are set (4)";
    case '9': return "the power stage is off or the emergency stop pressed (9)";
    case 'D': return "the speed is out of range (D)";
    case 'F': return "STOP was pressed (F)";
    case 'H': return "the cover is open (H)";
    default: return "refused; see the manual for this answer";
    }
}

/* Sends a command and waits this many milliseconds for the one byte that ends it. */
static void ask(int port, const char *command, int timeout)
{
    char line[64], answer;
    int length = snprintf(line, sizeof line, "%s\r", command);
    if (write(port, line, (size_t)length) != length)
        fail(2, "the port failed", "not everything could be sent");
    receive(port, &answer, 1, timeout, command);
    if (answer != '0')
        fail(1, command, meaning(answer));
}

static long number(const char *text, long low, long high)
{
    char *end;
    long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || value < low || value > high)
        fail(2, text, "a number is expected here, as in axis /dev/ttyUSB0 4000 900");
    return value;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fputs("usage: axis PORT STEPS SPEED, as in axis /dev/ttyUSB0 4000 900\n", stderr);
        return 2;
    }
    long steps = number(argv[2], -8388607, 8388607), speed = number(argv[3], 1, 40000);
    int port = open_port(argv[1]);
    ask(port, "@01", 2000);

    char command[64], digits[19] = "";
    snprintf(command, sizeof command, "@0A%ld,%ld", steps, speed);
    long seconds = labs(steps) / speed + 10; /* the move, its ramps, and patience */
    ask(port, command, (int)(seconds < 2000000 ? seconds * 1000 : 2000000000));

    ask(port, "@0P", 2000);
    receive(port, digits, 18, 2000, "@0P");
    digits[6] = '\0'; /* X is the first of three */
    long x = strtol(digits, NULL, 16);
    printf("X %ld\n", x < 1L << 23 ? x : x - (1L << 24));
    close(port);
    return 0;
}
