"""Drills two holes: a small driver with its program, as many a laboratory has one.

It works. It also has five mistakes that no test of the happy path finds, because each needs something to
go wrong; `vimc4 sweep` finds them all. mended.py is the same without them."""

import sys

import serial

HOLES = [(1_600, 800), (2_400, 1_600)]


class Drill:
    def __init__(self, path):
        self.port = serial.Serial(path, 19_200, timeout=0.15)
        self.at = [0, 0]
        self.start()

    def start(self):
        for command in ("@07", "@0R7"):
            code, _ = self.ask(command)
            if code != "0":
                raise SystemExit(f"{command}: the controller says {code!r}")
        self.at = [0, 0]

    def ask(self, command, digits=0):
        """Sends a command and returns the code of the answer, with what follows it."""
        for _ in range(3):
            self.port.write(command.encode() + b"\r")
            answer = self.port.read(1)
            if answer:
                break
            # Mistake 1: the move may have been made all the same, and is made again. Where the answer is
            # only late, it is taken for that of the second try.
        # Mistake 2: the answer has a fixed length, so this waits for as long as it takes.
        while answer and len(answer) < 1 + digits:
            answer += self.port.read(1)
        code = answer[:1].decode("latin-1")
        if code == "4":
            # Mistake 3: after a power failure nobody knows where the axes are, and this moves on.
            self.port.write(b"@07\r")
            self.port.read(1)
            return self.ask(command, digits)
        return code, answer[1:]

    def move(self, x, y):
        way = (x - self.at[0], y - self.at[1])
        code, _ = self.ask(f"@0A{way[0]},2000,{way[1]},2000,0,900,0,900")
        if code == "2":
            # Mistake 4: at a limit switch the axis is where it was going, or so it is believed.
            self.at = [x, y]
            return
        if code not in "0F":
            # Mistake 5: F is not an answer to pass over, the move is not finished.
            raise SystemExit(f"the controller says {code!r}")
        self.at = [x, y]

    def position(self):
        _, digits = self.ask("@0P", 18)
        return int(digits[:6], 16), int(digits[6:12], 16)


def main(path):
    drill = Drill(path)
    for x, y in HOLES:
        drill.move(x, y)
    drill.position()


if __name__ == "__main__":
    main(sys.argv[1])
