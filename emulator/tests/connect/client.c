/* A host program in C. Arguments: a terminal or a TCP address, and `lines` if it also sets and
 * reads the modem lines. */
#define _DEFAULT_SOURCE
#include <arpa/inet.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

static int port;

static void fail(const char *what) {
    fflush(stdout);
    perror(what);
    exit(1);
}

static void ask(const char *line, int count) {
    if (write(port, line, strlen(line)) < 0) {
        fail("write");
    }
    for (char answer; count > 0; count--) {
        if (read(port, &answer, 1) != 1) {
            fail("read");
        }
        putchar(answer);
    }
}

static void open_terminal(const char *name) {
    struct termios mode;
    port = open(name, O_RDWR | O_NOCTTY);
    if (port < 0 || tcgetattr(port, &mode) < 0) {
        fail(name);
    }
    cfmakeraw(&mode);
    cfsetspeed(&mode, B19200);
    tcsetattr(port, TCSANOW, &mode);
}

static void open_address(const char *name, const char *number) {
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(atoi(number))};
    char host[32] = {0};
    strncat(host, name, number - name - 1);
    inet_pton(AF_INET, host, &to.sin_addr);
    port = socket(AF_INET, SOCK_STREAM, 0);
    if (connect(port, (struct sockaddr *)&to, sizeof to) < 0) {
        fail(name);
    }
}

int main(int count, char **arguments) {
    const char *colon = strchr(arguments[1], ':');
    int rts = TIOCM_RTS, dtr = TIOCM_DTR, now;
    if (colon == NULL) {
        open_terminal(arguments[1]);
    } else {
        open_address(arguments[1], colon + 1);
    }
    ask("@01\r", 1);
    ask("@0A20000,10000\r", 0);
    usleep(300000);
    ask("\375", 1);
    ask("@0S\r", 1);
    ask("@0P\r", 19);
    putchar('\n');
    if (count > 2) {
        if (ioctl(port, TIOCMBIC, &dtr) < 0 || ioctl(port, TIOCMBIS, &rts) < 0 ||
            ioctl(port, TIOCMGET, &now) < 0) {
            fail("modem lines");
        }
        printf("CTS %d DSR %d DCD %d\n", !!(now & TIOCM_CTS), !!(now & TIOCM_DSR),
               !!(now & TIOCM_CD));
    }
    return 0;
}
