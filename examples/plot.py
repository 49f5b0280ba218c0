"""Sends a plot over a serial port and heeds CTS, with pyserial: plot.py PORT [FILE]"""

import pathlib
import sys

import serial

port = serial.Serial(sys.argv[1], 9600, timeout=60)
plot = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).with_name("board.plt")

for byte in pathlib.Path(plot).read_bytes().replace(b"\n", b""):
    while not port.cts:  # the command buffer is nearly full
        pass
    port.write(bytes([byte]))

# Where it stands at the end: the answer comes when all that was before is done.
port.write(b"!ON0;")
answer = b""
while b"P" not in answer or not answer.endswith(b"C\r"):
    answer += port.read(1)
print(answer.decode().split("P")[-1].splitlines()[0])
