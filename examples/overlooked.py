"""A driver with a mistake, for `vimc4 console` to find: it takes whatever is answered for a 0.

When somebody presses STOP the controller answers F, and the rest of the way is not gone. This driver
goes on with ways that count from where it believes to be.
"""
import sys

port = open(sys.argv[1] if len(sys.argv) > 1 else "vimc4.pty", "r+b", buffering=0)


def send(line):
    port.write(line.encode() + b"\r")
    port.read(1)  # the mistake


send("@07")
send("@0R7")
for _ in range(3):
    send("@0A20000,8000,0,900,0,900,0,900")
    send("@0A-20000,8000,0,900,0,900,0,900")
