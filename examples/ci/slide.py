"""A slide that carries samples under a camera, on the X axis of an isel controller: a program as any
project may have one. It has a mistake, which its tests find."""

import socket

STEPS_PER_MM = 80


class Slide:
    def __init__(self, host, port):
        self.port = socket.create_connection((host, port), timeout=30)
        self.ask("@07")

    def close(self):
        self.port.close()

    def reference(self):
        """Drives to the reference switch; there is zero."""
        self.ask("@0R7")

    def move_by(self, mm):
        self.ask(f"@0A{round(mm * STEPS_PER_MM)},8000,0,900,0,900,0,900")

    def place(self):
        """Where the slide is, in millimetres."""
        return int(self.ask("@0P", 18)[:6], 16) / STEPS_PER_MM

    def ask(self, command, digits=0):
        self.port.sendall(command.encode() + b"\r")
        answer = b""
        while len(answer) < 1 + digits:
            piece = self.port.recv(1 + digits - len(answer))
            if not piece:
                raise ConnectionError("the controller has hung up")
            answer += piece
        # The mistake: the first character says whether it was done, and nobody looks at it.
        return answer[1:].decode()
