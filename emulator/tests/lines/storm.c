/* A program that makes it as hard as it can. It says what went wrong, which should be nothing. */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { THREADS = 50, CALLS = 2000 };

static const char *path;
static long wrong;
static volatile int shared = -1, enough;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

static void *ask(void *none)
{
    int i, lines, port = open(path, O_RDWR | O_NOCTTY);
    for (i = 0; i < CALLS; i++) {
        lines = 0;
        if (ioctl(port, TIOCMGET, &lines) || (lines & 0x126) != 0x126)
            __sync_fetch_and_add(&wrong, 1);
    }
    close(port);
    return none;
}

static void *open_and_close(void *none)
{
    while (!enough) {
        shared = open(path, O_RDWR | O_NOCTTY);
        usleep(20);
        close(shared);
    }
    return none;
}

static void *ask_meanwhile(void *none)
{
    int i, lines;
    for (i = 0; i < 5000; i++)
        /* The descriptor may be another file meanwhile, or none. */
        if (ioctl(shared, TIOCMGET, &lines) && errno != EBADF && errno != ENOTTY)
            __sync_fetch_and_add(&wrong, 1);
    return none;
}

/* Requests of all kinds with arguments of all kinds, the same in every run of a seed. Nothing is
   to come of it but an answer each. */
static void *anything(void *seed)
{
    static const int requests[] = {TIOCMGET, TIOCMBIS, TIOCMBIC, TIOCMSET, TIOCGSERIAL,
                                   TIOCSSERIAL, TIOCSERGETLSR, TIOCGICOUNT};
    unsigned s = (unsigned)(long)seed;
    int i, port = open(path, O_RDWR | O_NOCTTY);
    char *page = mmap(NULL, 8192, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    munmap(page + 4096, 4096);
    for (i = 0; i < 3000; i++) {
        long request = requests[rand_r(&s) % 8], high = (long)rand_r(&s) << 32;
        long file = rand_r(&s) % 8 ? port : rand_r(&s);
        char *argument = page + rand_r(&s) % 4200;
        if (rand_r(&s) % 4 == 0)
            argument = (char *)((long)rand_r(&s) << rand_r(&s) % 33);
        syscall(SYS_ioctl, file | high, request | high, argument);
        if (rand_r(&s) % 500 == 0) {
            kill(getpid(), SIGALRM);
            if (fork() == 0)
                execl("/bin/true", "true", (char *)NULL);
        }
    }
    return NULL;
}

static void nothing(int signal)
{
    (void)signal;
}

/* The best of many short rounds, because others use the processor too. */
static double best(int port, int request)
{
    double least = 1, began;
    int round, i, lines;
    for (round = 0; round < 1000; round++) {
        began = now();
        for (i = 0; i < 10; i++)
            ioctl(port, request, &lines);
        began = (now() - began) / 10;
        least = began < least ? began : least;
    }
    return least * 1e6;
}

int main(int argc, char **argv)
{
    pthread_t threads[THREADS], closer;
    struct sigaction action;
    struct itimerval often = {{0, 1000}, {0, 1000}}, never = {{0, 0}, {0, 0}};
    int i, k, status, lines, port, killed = 0;

    path = argv[argc - 1];
    for (i = 0; i < THREADS; i++)
        pthread_create(&threads[i], NULL, ask, NULL);
    for (i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
    printf("fifty threads: %ld wrong\n", wrong);

    pthread_create(&closer, NULL, open_and_close, NULL);
    for (i = 0; i < 4; i++)
        pthread_create(&threads[i], NULL, ask_meanwhile, NULL);
    for (i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
    enough = 1;
    pthread_join(closer, NULL);
    printf("closed in a call: %ld wrong\n", wrong);

    for (i = 0; i < 500; i++) {
        pid_t child = fork();
        if (child == 0) {
            port = open(path, O_RDWR | O_NOCTTY);
            for (k = 0; i % 2 == 0 || k < 3; k++)
                if (ioctl(port, TIOCMGET, &lines))
                    _exit(1);
            if (i % 10 == 1)
                execl("/bin/true", "true", (char *)NULL);
            _exit(0);
        }
        if (i % 2 == 0) {
            usleep(300);
            kill(child, SIGKILL);
        }
        waitpid(child, &status, 0);
        killed += WIFSIGNALED(status);
        wrong += WIFEXITED(status) && WEXITSTATUS(status);
    }
    printf("killed in a call: %d, %ld wrong\n", killed, wrong);

    /* Nothing but EINTR may come of signals, and what lies next to the argument stays. */
    port = open(path, O_RDWR | O_NOCTTY);
    memset(&action, 0, sizeof action);
    action.sa_handler = nothing;
    for (k = 0; k < 2; k++) {
        action.sa_flags = k ? SA_RESTART : 0;
        sigaction(SIGALRM, &action, NULL);
        setitimer(ITIMER_REAL, &often, NULL);
        for (i = 0; i < 20000; i++) {
            struct { int before, lines, after; } v = {1, 0, 2};
            if (ioctl(port, TIOCMGET, &v.lines))
                wrong += k || errno != EINTR;
            else
                wrong += v.lines != 0x126;
            wrong += v.before != 1 || v.after != 2;
        }
        setitimer(ITIMER_REAL, &never, NULL);
    }
    printf("interrupted: %ld wrong\n", wrong);

    for (i = 0; i < 8; i++)
        pthread_create(&threads[i], NULL, anything, (void *)(long)i);
    for (i = 0; i < 8; i++)
        pthread_join(threads[i], NULL);
    while (wait(&status) > 0)
        wrong += WIFSIGNALED(status);
    printf("anything: %ld wrong\n", wrong);

    /* Those who wait for a change do not hold up others, and go with their process. */
    for (i = 0; i < 200; i++)
        if (fork() == 0) {
            ioctl(port, TIOCMIWAIT, TIOCM_CTS);
            _exit(0);
        }
    usleep(200000);
    fprintf(stderr, "beside 200 who wait a request takes %.1f us\n", best(port, TIOCMGET));
    signal(SIGTERM, SIG_IGN);
    kill(0, SIGTERM);
    for (i = 0; wait(&status) > 0; i++)
        ;
    printf("of those who wait killed: %d\n", i);

    /* How long a request takes is said, not judged: see docs/connect.md for the figures. */
    fprintf(stderr, "a request takes %.1f us\n", best(port, TIOCMGET));
    fprintf(stderr, "a request that is let through takes %.1f us\n", best(port, TIOCINQ));
    return 0;
}
