"""Job control: an interactive shell that runs `vimc4 lines`, at a terminal of its own.

usage: jobs.py VIMC4 LINK
"""
import os
import pty
import select
import signal
import sys
import time

LINES = f"{sys.argv[1]} lines --pty {sys.argv[2]} --"

shell, terminal = pty.fork()
if shell == 0:
    # Who starts tests in the background of a script has Ctrl-C ignored, and hands that down.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    os.environ["PS1"] = "ready> "
    os.execvp("bash", ["bash", "--norc", "--noprofile", "--noediting", "-i"])

seen = b""


def expect(text):
    """Waits until the terminal shows this, and forgets all up to there."""
    global seen
    end = time.monotonic() + 20
    while text not in seen:
        if not select.select([terminal], [], [], max(0, end - time.monotonic()))[0]:
            sys.exit(f"{text} does not come; the terminal shows {seen}")
        seen += os.read(terminal, 4096)
    seen = seen.split(text, 1)[1]


def keys(text):
    os.write(terminal, text)


def run(command):
    expect(b"ready> ")
    keys(command.encode() + b"\n")


def echoes(word):
    """`cat` is there and has the terminal: the word comes back twice."""
    keys(word + b"\n")
    expect(word + b"\r\n" + word + b"\r\n")


def in_foreground(name):
    """Waits until the terminal belongs to the program of this name: keys then reach it."""
    end = time.monotonic() + 20
    while True:
        try:
            with open(f"/proc/{os.tcgetpgrp(terminal)}/comm") as comm:
                has = comm.read().strip()
        except FileNotFoundError:
            has = "what has just ended"
        if has == name:
            return
        if time.monotonic() > end:
            sys.exit(f"{name} does not get the terminal, which {has} has")
        time.sleep(0.02)


CTRL_C, CTRL_Z = b"\x03", b"\x1a"

# Stopped, woken, stopped for reading in the background, woken, interrupted.
run(f"{LINES} sh -c 'echo here; exec cat'")
expect(b"\r\nhere\r\n")
echoes(b"one")
keys(CTRL_Z)
expect(b"Stopped")
run("fg")
expect(b"lines")
echoes(b"two")
keys(CTRL_Z)
expect(b"Stopped")
run("bg; until [ \"$(jobs -s)\" ]; do sleep 0.1; done; jobs")
expect(b"Stopped")
run("fg")
expect(b"lines")
echoes(b"three")
keys(CTRL_C)
run("echo code=$?")
expect(b"\r\ncode=130\r\n")

# A shell within that has jobs of its own.
run(f"{LINES} bash --norc --noprofile --noediting -i")
run("sleep 100")
in_foreground("sleep")
keys(CTRL_Z)
expect(b"Stopped")
run("fg")
expect(b"sleep 100\r\n")
in_foreground("sleep")
keys(CTRL_C)
run("exit 5")
run("echo code=$?")
expect(b"\r\ncode=5\r\n")

# A program that stops itself, as editors do.
run(f"{LINES} sh -c 'kill -STOP $$; echo woken'")
expect(b"Stopped")
run("fg")
expect(b"\r\nwoken\r\n")

# In the background a debugger may stop the program, and the answers go on.
run(f"{LINES} sleep 100 & until pkill -STOP -P $! sleep; do sleep 0.1; done; sleep 0.3; echo state=$(ps -o stat= -p $!)")
expect(b"\r\nstate=S")
run("kill -CONT %1; kill %1; wait %1; echo code=$?")
expect(b"code=143\r\n")
expect(b"ready> ")
keys(b"exit\n")
sys.exit(os.waitstatus_to_exitcode(os.waitpid(shell, 0)[1]))
