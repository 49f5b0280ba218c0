"""Drills holes: a small driver, as many a laboratory has one.

It works, and test_drill.py passes. It also has five mistakes that no test of the happy path finds, because
each needs something to go wrong; `vimc4 sweep` finds them all. mended.py is the same without them."""

import serial


class Trouble(Exception):
    """The controller did not do what it was asked for, or nobody knows whether it did."""


class Drill:
    def __init__(self, path):
        self.port = serial.Serial(path, 19_200, timeout=0.3)
        for command in ("@07", "@0R7"):
            self.ask(command)
        self.at = self.position()

    def drill(self, holes):
        """Drills these holes, and returns how many it has drilled."""
        drilled = 0
        for x, y in holes:
            self.move(x, y)
            drilled += 1
        return drilled

    def ask(self, command, digits=0):
        """Sends a command and returns what follows the code of its answer."""
        self.port.write(command.encode() + b"\r")
        answer = self.port.read(1)
        if not answer:
            raise TimeoutError(f"{command}: no answer")
        # Mistake 1: an answer that lacks a byte is waited for, for ever.
        while len(answer) < 1 + digits:
            answer += self.port.read(1)
        code = answer[:1].decode("latin-1")
        if code == "4":
            # Mistake 2: the power has failed and nobody knows where the axes are, and it moves on.
            self.ask("@07")
            return self.ask(command, digits)
        # Mistake 3: F is passed over. Somebody has pressed STOP, and the move is not finished.
        if code not in "02F":
            raise Trouble(f"{command}: the controller says {code!r}")
        # Mistake 4: so is 2. Behind a limit switch the axis is not where it should have gone.
        return answer[1:]

    def move(self, x, y):
        way = (x - self.at[0], y - self.at[1])
        try:
            self.ask(f"@0A{way[0]},2000,{way[1]},2000,0,900,0,900")
            self.at = (x, y)
        except TimeoutError:
            # Mistake 5: if the answer is only late, it is taken for the answer to this question, and the
            # digits are taken one place too early.
            self.at = self.position()

    def position(self):
        digits = self.ask("@0P", 18)
        return int(digits[:6], 16), int(digits[6:12], 16)
