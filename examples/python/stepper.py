"""A small driver for isel controllers, as any project may have one. It knows nothing of virtual
controllers: its port is any that pyserial opens."""

MEANINGS = {
    "2": "a limit switch was reached; make a reference run before the next move",
    "4": "the controller knows no axes, as after a power failure; open it again",
    "9": "the power stage is off; release the emergency stop, press ON and open it again",
    "F": "somebody pressed STOP; resume to finish the move",
    "H": "the cover is open; close it",
}


class StepperError(Exception):
    """The controller did not do what it was asked for. `code` is what it answered, "" if it
    answered nothing in time."""

    def __init__(self, command, code):
        meaning = MEANINGS.get(code, "see the manual") if code else "is it switched on?"
        super().__init__(f"{command} was answered {code!r}: {meaning}")
        self.code = code


class Stepper:
    """A controller with the axes X, Y and Z."""

    def __init__(self, port):
        self.port = port
        self.ask("@07")

    def reference(self):
        """Drives all axes to their reference switches; there is their zero."""
        self.ask("@0R7")

    def move_by(self, x, y, z, speed):
        """Moves by so many steps, with this many steps a second, and waits for the end."""
        self.start_move_by(x, y, z, speed)
        self.wait()

    def start_move_by(self, x, y, z, speed):
        """Does not wait."""
        self.send(f"@0A{x},{speed},{y},{speed},{z},{speed},0,{speed}")

    def start_resume(self):
        """Goes on with a move that was stopped; does not wait."""
        self.send("@0S")

    def position(self):
        """Where the axes are, in steps."""
        self.ask("@0P")
        digits = self.port.read(18).decode("ascii")
        values = [int(digits[at : at + 6], 16) for at in (0, 6, 12)]
        return tuple(value - (1 << 24) if value >= 1 << 23 else value for value in values)

    def read_input(self, port):
        """The eight bits of an input port."""
        self.ask(f"@0b{port}")
        return int(self.port.read(2), 16)

    def spindle(self, on):
        """Switches the spindle, which hangs on the first output."""
        self.ask(f"@0B2,{on:d}")

    def ask(self, command):
        self.send(command)
        self.wait()

    def send(self, command):
        self.command = command
        self.port.write(command.encode("ascii") + b"\r")

    def wait(self):
        """Waits for the end of what was sent."""
        code = self.port.read(1).decode("ascii", "replace")
        if code != "0":
            raise StepperError(self.command, code)
