"""Host software for an LPKF machine whose job ends early, and that begins the next one as it
begins every job."""

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


def begin():
    """What every job begins with: a reset, and the echo mode. What comes before is of no interest."""
    port.write(b"IN;!CT1;")
    assert port.read_until(b"Z").endswith(b"Z")
    assert line() == "C"


def job():
    """A job that comes to its end."""
    begin()
    for command in [b"!CM1;", b"!TM0,10,0,10;", b"VS50000;", b"PA30,20;", b"PD;", b"PA60,20;"]:
        done(command)
    done(b"PU;")
    port.write(b"!ON0;")
    assert line() == "P60,20,0"
    assert line() == "C"
    assert port.in_waiting == 0


job()

# A move that would leave the window. What was sent behind it is never executed.
begin()
done(b"IW0,0,50,50;")
port.write(b"PA90,0;PA0,0;!ON0;")
assert line() == "E08"
job()

# The same with much more behind it than the command buffer takes.
begin()
done(b"IW0,0,50,50;")
port.write(b"PA90,0;" + b"PR1,0;" * 1000)
while line() != "E08":
    pass
job()

# A move onto a limit switch.
begin()
port.write(b"PA-9,0;PA0,0;")
assert line() == "E09"
job()

# Somebody presses the stop at the machine.
begin()
done(b"!ES1;")
done(b"!VU1000;")
port.write(b"PA500,0;")
print("stop", flush=True)
answer = line()
# Where time does not pass the move is over before anybody can.
assert answer == "E0A" or (answer == "C" and line() == "E0A"), answer
port.write(b"PA0,0;")
job()
