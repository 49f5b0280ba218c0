"""Ctrl-Z right behind a shell's `fg`: a program that runs under `vimc4 lines` stops again, and `vimc4
lines` with it, however late it comes to run after it was woken.

usage: again.py VIMC4 LINK
"""
import os
import pty
import select
import signal
import sys

ROUNDS, LIMIT = 60, 20
LINES = [sys.argv[1], "lines", "--pty", sys.argv[2], "--", "sh", "-c", "echo here; exec cat"]
CTRL_Z = b"\x1a"

news, tell = os.pipe()
shell, terminal = pty.fork()
if shell == 0:
    # A shell that has one job, says its number, and says when it has stopped.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    job = os.fork()
    if job == 0:
        os.setpgid(0, 0)
        os.tcsetpgrp(0, os.getpid())
        signal.signal(signal.SIGTTOU, signal.SIG_DFL)
        os.execv(LINES[0], LINES)
    os.write(tell, b"%d\n" % job)
    while os.WIFSTOPPED(os.waitpid(job, os.WUNTRACED)[1]):
        os.write(tell, b"stopped\n")
    os._exit(0)
os.close(tell)
shown = b""


def comes(source, what):
    if not select.select([source], [], [], LIMIT)[0]:
        sys.exit(f"{what} does not come; the terminal shows {shown}")
    return os.read(source, 4096)


job = int(comes(news, "the job"))
while b"\r\nhere\r\n" not in b"\r\n" + shown:
    shown += comes(terminal, "the program")
os.write(terminal, CTRL_Z)
for round in range(ROUNDS):
    assert comes(news, f"stop {round}") == b"stopped\n", "the job has ended"
    os.killpg(job, signal.SIGCONT)
    os.write(terminal, CTRL_Z)
comes(news, "the last stop")

# What is woken alone wakes the program, too.
os.kill(job, signal.SIGCONT)
os.write(terminal, b"word\n")
shown = b""
while b"word\r\nword\r\n" not in shown:
    shown += comes(terminal, "the answer")
os.killpg(job, signal.SIGKILL)
os.waitpid(shell, 0)
