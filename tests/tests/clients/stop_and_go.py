"""A long move is stopped by 253, read back, and finished by S."""

import sys
import time

import serial


def main(name):
    port = serial.serial_for_url(name, 19200, timeout=20)
    port.write(b"@01\r")
    assert port.read(1) == b"0"
    port.write(b"@0A20000,10000\r")
    time.sleep(0.3)
    port.write(b"\xfd")
    assert port.read(1) == b"F"
    port.write(b"@0P\r")
    answer = port.read(19)
    reached = int(answer[1:7], 16)
    assert 0 < reached < 20000, reached
    port.write(b"@0S\r")
    assert port.read(1) == b"0"
    port.write(b"@0P\r")
    assert port.read(19) == b"0004E20000000000000"
    port.close()


main(sys.argv[1])
