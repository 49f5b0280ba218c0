"""A host program in Python. Arguments: the port as pyserial or VISA names it, and `lines` if it
also sets and reads the modem lines."""

import sys
import time

name = sys.argv[1]
if "::" in name:
    import pyvisa

    port = pyvisa.ResourceManager("@py").open_resource(name, read_termination=None)
    port.timeout = 5000
    if name.startswith("ASRL"):
        port.baud_rate = 19200
    send = port.write_raw

    def receive(count):
        return port.read_bytes(count, break_on_termchar=False)
else:
    import serial

    port = serial.serial_for_url(name, 19200, timeout=5)
    send, receive = port.write, port.read


def ask(line, count):
    send(line)
    answer = receive(count) if count else b""
    assert len(answer) == count, f"{line!r} answered {answer!r}"
    return answer.decode("ascii")


print(ask(b"@01\r", 1), end="")
ask(b"@0A20000,10000\r", 0)
time.sleep(0.3)
print(ask(b"\xfd", 1), end="")
print(ask(b"@0S\r", 1), end="")
print(ask(b"@0P\r", 19), flush=True)

if "lines" in sys.argv[2:]:
    # Each of the six, so that the first that fails does not hide the others.
    failed = []
    for line, use in {
        "dtr": lambda: setattr(port, "dtr", False),
        "rts": lambda: setattr(port, "rts", True),
        "cts": lambda: port.cts,
        "dsr": lambda: port.dsr,
        "dcd": lambda: port.cd,
        "ri": lambda: port.ri,
    }.items():
        try:
            use()
        except OSError as error:
            failed.append(f"{line}: {error.strerror}")
    if failed:
        sys.exit("\n".join(failed))
    assert not port.ri
    print(f"CTS {int(port.cts)} DSR {int(port.dsr)} DCD {int(port.cd)}")
port.close()
