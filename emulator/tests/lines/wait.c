/* Waits for a change of CTS, and says what ends the waiting.

   wake: another process switches RTS off.   handler: a signal comes whose handler interrupts.
   restart: one whose handler does not, and then RTS goes off.
   park: nothing ends it from here.   parked: a hundred threads wait so.
   ctty: asks over /dev/tty.   close: asks before and after the last closing. */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/time.h>
#include <unistd.h>

static int port, signals;

static void handle(int signal)
{
    (void)signal;
    signals++;
}

static void switch_off_after(int milliseconds)
{
    int rts = TIOCM_RTS;
    if (fork() == 0) {
        usleep(milliseconds * 1000);
        ioctl(port, TIOCMBIC, &rts);
        _exit(0);
    }
}

static void *park(void *none)
{
    (void)none;
    ioctl(port, TIOCMIWAIT, TIOCM_CTS);
    return NULL;
}

int main(int argc, char **argv)
{
    const char *what = argv[1];
    struct sigaction action;
    pthread_t thread;
    int i, lines = 0, result;

    if (argc < 3)
        return 2;
    setvbuf(stdout, NULL, _IONBF, 0);
    if (strcmp(what, "ctty") == 0) {
        /* A leader that gives its terminal up is told to hang up too. */
        signal(SIGHUP, SIG_IGN);
        setsid();
        port = open(argv[2], O_RDWR);
        ioctl(port, TIOCSCTTY, 0);
        result = ioctl(open("/dev/tty", O_RDWR), TIOCMGET, &lines);
        printf("%d %x\n", result, lines);
        ioctl(port, TIOCNOTTY);
        return 0;
    }
    port = open(argv[2], O_RDWR | O_NOCTTY);
    if (strcmp(what, "close") == 0) {
        ioctl(port, TIOCMSET, &lines);
        close(port);
        port = open(argv[2], O_RDWR | O_NOCTTY);
        result = ioctl(port, TIOCMGET, &lines);
        printf("%d %x\n", result, lines);
        return 0;
    }
    memset(&action, 0, sizeof action);
    action.sa_handler = handle;
    action.sa_flags = strcmp(what, "restart") == 0 ? SA_RESTART : 0;
    sigaction(SIGALRM, &action, NULL);
    if (strcmp(what, "wake") == 0)
        switch_off_after(200);
    if (strcmp(what, "restart") == 0)
        switch_off_after(600);
    if (strcmp(what, "handler") == 0 || strcmp(what, "restart") == 0) {
        struct itimerval later = {{0, 0}, {0, 200000}};
        setitimer(ITIMER_REAL, &later, NULL);
    }
    if (strcmp(what, "parked") == 0)
        for (i = 0; i < 100; i++)
            pthread_create(&thread, NULL, park, NULL);
    puts("waiting");
    result = ioctl(port, TIOCMIWAIT, TIOCM_CTS);
    printf("%s, signals %d\n", result == 0 ? "changed" : strerror(errno), signals);
    return 0;
}
