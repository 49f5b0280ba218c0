"""Host software for an LPKF machine, as it is written in the field."""

import sys

import serial

port = serial.serial_for_url(sys.argv[1], timeout=10)


def line():
    """One answer, without its CR."""
    answer = port.read_until(b"\r")
    assert answer.endswith(b"\r"), f"{answer!r} has no end"
    return answer[:-1].decode()


def done(command):
    """Sends one command and waits until it is done."""
    port.write(command)
    answer = line()
    assert answer == "C", f"{command!r} answered {answer}"


def position():
    port.write(b"!ON0;")
    places = line()
    assert line() == "C"
    return places


# One command after the other, each awaited.
for command in [b"!CT1;", b"!IS;", b"!CM1;", b"!TM0,10,0,10;", b"VS20000;", b"PA1000,500;", b"PD;"]:
    done(command)
done(b"AA1500,500,-180.000000;")
done(b"PU;")
assert position() == "P2000,500,0", position()

# Several commands in one write are acknowledged one by one, in order.
port.write(b"PA0,0;!ON1;PR10,0PR0,10!ON0;!EM1;!EM0;")
answers = [line() for _ in range(8)]
assert answers == ["C", "P0", "C", "C", "C", "P10,10,0", "C", "C"], answers
assert line() == "C"

# Ends of lines as different programs write them.
for end in [b"\r", b"\r\n", b";\r\n", b";\n", b";\0", b"\r\0"]:
    done(b"PR1,1" + end)
assert position() == "P16,16,0", position()

# `IN` sends a single Z without an end; the settings are restored.
port.write(b"IN;!CT1;")
assert port.read(1) == b"Z"
assert line() == "C"
port.write(b"VS5000;!VU40000;!TD0,20,0,20;")
assert [line() for _ in range(3)] == ["C", "C", "C"]
port.write(b"OS;")
assert line().startswith("S") and line() == "C"

# The spindle unit on the second channel answers for itself; nothing but the closing is `C`.
port.write(b"!OC;!SV5;!SM1;!WR1,2;!RM20;!CC;")
answers = [line() for _ in range(5)]
assert answers == ["0", "0", "0", "C", "8"], answers

# A wrong command answers its status, and the next works.
port.write(b"PA5;PA7,7;!ON0;")
answers = [line() for _ in range(4)]
assert answers == ["E06", "C", "P7,7,0", "C"], answers
assert port.in_waiting == 0
