"""Drills holes: drill.py without its mistakes.

Whatever goes wrong, it either ends where it should or says that it does not."""

import serial

MEANINGS = {
    "2": "a limit switch was hit",
    "4": "the controller knows no axes, as after a power failure",
    "9": "the emergency stop is pressed, or the power stage is off",
    "F": "somebody pressed STOP",
}


class Trouble(Exception):
    """The controller did not do what it was asked for, or nobody knows whether it did."""


class Drill:
    def __init__(self, path):
        # An answer that takes longer than this is lost.
        self.port = serial.Serial(path, 19_200, timeout=0.3)
        # Without its R, @0R7 is @07 and answered as well. It is made twice, so that one is made.
        for command in ("@07", "@0R7", "@0R7"):
            self.ask(command)
        self.expect((0, 0, 0))

    def drill(self, holes):
        """Drills these holes, and returns how many it has drilled."""
        for x, y in holes:
            self.move(x, y)
        return len(holes)

    def ask(self, command, digits=0):
        """Sends a command and returns what follows the code of its answer."""
        self.port.write(command.encode() + b"\r")
        answer = self.port.read(1 + digits)
        if answer[:1] != b"0" or len(answer) < 1 + digits or self.port.in_waiting:
            code = answer[:1].decode("latin-1")
            raise Trouble(f"{command}: {MEANINGS.get(code, repr(answer))}")
        return answer[1:]

    def move(self, x, y):
        at = self.position()
        way = (x - at[0], y - at[1])
        self.ask(f"@0A{way[0]},2000,{way[1]},2000,0,900,0,900")
        self.expect((x, y, 0))

    def position(self):
        """Asks twice: a digit can be garbled on the way."""
        one, two = self.ask("@0P", 18), self.ask("@0P", 18)
        if one != two:
            raise Trouble("the position cannot be read")
        try:
            return tuple(int(one[at : at + 6], 16) for at in (0, 6, 12))
        except ValueError as error:
            raise Trouble("the position cannot be read") from error

    def expect(self, place):
        """A number that lost a digit on its way is a number, too: only the position tells."""
        if self.position() != place:
            raise Trouble(f"it is not at {place}")
