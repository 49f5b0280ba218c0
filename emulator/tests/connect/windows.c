/* A host program for Windows. Arguments: a COM port, and `lines` if it also uses the modem
 * lines and waits for events. Everything that fails is said; the exit code is 1 then. */
#include <stdio.h>
#include <string.h>
#include <windows.h>

static HANDLE port;
static int failures;

static void say(const char *what, BOOL worked) {
    if (worked) {
        printf("%s\n", what);
    } else {
        printf("%s: error %lu\n", what, GetLastError());
        failures = 1;
    }
    fflush(stdout);
}

static BOOL open_port(const char *name) {
    char path[32];
    DCB dcb = {.DCBlength = sizeof dcb};
    COMMTIMEOUTS timeouts = {0, 0, 5000, 0, 5000};
    snprintf(path, sizeof path, "\\\\.\\%s", name);
    port = CreateFileA(path, GENERIC_READ | GENERIC_WRITE, 0, NULL, OPEN_EXISTING,
                       FILE_FLAG_OVERLAPPED, NULL);
    if (port == INVALID_HANDLE_VALUE) {
        say("CreateFile", FALSE);
        return FALSE;
    }
    if (!GetCommState(port, &dcb)) {
        say("GetCommState", FALSE);
        return FALSE;
    }
    dcb.BaudRate = 19200;
    dcb.ByteSize = 8;
    dcb.Parity = NOPARITY;
    dcb.StopBits = ONESTOPBIT;
    dcb.fBinary = TRUE;
    dcb.fDtrControl = DTR_CONTROL_ENABLE;
    dcb.fRtsControl = RTS_CONTROL_ENABLE;
    if (!SetCommState(port, &dcb) || !SetCommTimeouts(port, &timeouts)) {
        say("SetCommState", FALSE);
        return FALSE;
    }
    return TRUE;
}

/* Sends a line and reads so many bytes, both overlapped. */
static void ask(const char *line, DWORD count) {
    char answer[32] = {0};
    DWORD done = 0;
    OVERLAPPED writing = {.hEvent = CreateEvent(NULL, TRUE, FALSE, NULL)};
    OVERLAPPED reading = {.hEvent = CreateEvent(NULL, TRUE, FALSE, NULL)};
    WriteFile(port, line, strlen(line), NULL, &writing);
    GetOverlappedResult(port, &writing, &done, TRUE);
    if (count > 0) {
        ReadFile(port, answer, count, NULL, &reading);
        GetOverlappedResult(port, &reading, &done, TRUE);
    }
    printf("%s", answer);
    fflush(stdout);
}

/* Waits for one of these events, which the answer to a line or nothing at all brings about. */
static void wait_for(const char *what, DWORD mask, const char *line, DWORD expected) {
    OVERLAPPED waiting = {.hEvent = CreateEvent(NULL, TRUE, FALSE, NULL)};
    DWORD events = 0, done = 0;
    char text[64];
    PurgeComm(port, PURGE_RXCLEAR);
    if (!SetCommMask(port, mask) || (!WaitCommEvent(port, &events, &waiting) &&
                                     GetLastError() != ERROR_IO_PENDING)) {
        say(what, FALSE);
        return;
    }
    if (line != NULL) {
        ask(line, 0);
    }
    if (WaitForSingleObject(waiting.hEvent, 500) == WAIT_TIMEOUT) {
        /* Nothing came; this ends the waiting. */
        SetCommMask(port, 0);
        WaitForSingleObject(waiting.hEvent, 5000);
        events = 0;
    } else if (!GetOverlappedResult(port, &waiting, &done, FALSE)) {
        say(what, FALSE);
        return;
    }
    snprintf(text, sizeof text, "%s: %lx", what, events);
    say(text, TRUE);
    failures |= events != expected;
    Sleep(200);
}

int main(int count, char **arguments) {
    DWORD status = 0;
    char text[64];
    if (!open_port(arguments[1])) {
        return 1;
    }
    ask("@01\r", 1);
    ask("@0A20000,10000\r", 0);
    Sleep(300);
    ask("\375", 1);
    ask("@0S\r", 1);
    ask("@0P\r", 19);
    printf("\n");
    CloseHandle(port);
    if (!open_port(arguments[1])) {
        return 1;
    }
    if (count > 2) {
        say("EscapeCommFunction", EscapeCommFunction(port, CLRDTR) &&
            EscapeCommFunction(port, SETDTR) && EscapeCommFunction(port, CLRRTS) &&
            EscapeCommFunction(port, SETRTS));
        BOOL worked = GetCommModemStatus(port, &status);
        snprintf(text, sizeof text, "GetCommModemStatus: %lx", status);
        say(worked ? text : "GetCommModemStatus", worked);
        wait_for("WaitCommEvent RXCHAR", EV_RXCHAR, "@0P\r", EV_RXCHAR);
        wait_for("WaitCommEvent CTS DSR RXCHAR", EV_CTS | EV_DSR | EV_RXCHAR, "@0P\r", EV_RXCHAR);
        wait_for("WaitCommEvent CTS DSR", EV_CTS | EV_DSR, NULL, 0);
    }
    return failures;
}
