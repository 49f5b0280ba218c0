"""A host program as people write it: sets axes, moves, reads the position. Argument: the port,
as pyserial names it."""

import sys

import serial


def main(name):
    port = serial.serial_for_url(name, 19200, timeout=5)

    def ask(line, count):
        port.write(line.encode("ascii") + b"\r")
        answer = port.read(count)
        assert len(answer) == count, f"{line}: {answer!r} instead of {count} bytes"
        return answer

    assert ask("@07", 1) == b"0"
    assert ask("@0A 256,9000,-2,900,0,900,0,900", 1) == b"0"
    assert ask("@0P", 19) == b"0000100FFFFFE000000"
    assert ask("@08", 1) == b"0"
    assert ask("@0P", 25) == b"0000100FFFFFE000000000000"

    # A second reader of the same line sees nothing more: every answer is exactly that long.
    port.timeout = 0.2
    assert port.read(1) == b""
    port.close()

    # The controller is where it was when the port is opened again.
    port = serial.serial_for_url(name, 19200, timeout=5)
    assert ask("@0P", 25) == b"0000100FFFFFE000000000000"
    port.close()


main(sys.argv[1])
