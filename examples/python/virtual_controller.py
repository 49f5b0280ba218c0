"""A virtual controller for the tests of a driver: starts `vimc4 serve`, ends it, and is the
person at the machine meanwhile."""

import json
import os
import queue
import subprocess
import threading


class VirtualController:
    """Close it, or use it in a `with` block:

        with VirtualController("--model", "imc-s8", "--time", "instant") as controller:
            port = serial.serial_for_url(controller.url, timeout=5)

    The arguments are those of `vimc4 serve`. The program is the one that the environment
    variable VIMC4 names, else the `vimc4` on the path."""

    def __init__(self, *arguments):
        program = os.environ.get("VIMC4", "vimc4")
        # Any free port and no link, so that tests can run side by side. Standard error is left
        # alone: messages of vimc4 appear among those of the tests.
        defaults = [("--tcp", "127.0.0.1:0"), ("--pty", "none")]
        missing = [default for default in defaults if default[0] not in arguments]
        self.process = subprocess.Popen(
            [
                program, "serve", "--json", *(word for default in missing for word in default),
                # However the tests end, the controller ends with them.
                "--until-stdin-closes", *arguments,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.answers = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        try:
            places = json.loads(self._answer("the start"))["controllers"][0]
        except RuntimeError:
            self.close()
            raise
        self.pty = places["pty"]
        self.url = f"socket://{places['tcp']}"

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def order(self, order):
        """Does what a person at the machine would, as in `press stop`, `cover open`,
        `input 0.3 1` or `advance 250ms`, and returns the answer. `vimc4 serve` lists all orders
        when `help` is typed."""
        print(order, file=self.process.stdin, flush=True)
        answer = self._answer(f"`{order}`")
        if answer.startswith("error: "):
            raise RuntimeError(answer.removeprefix("error: "))
        return answer

    def _read(self):
        for line in self.process.stdout:
            self.answers.put(line.rstrip("\n"))
        self.answers.put(None)

    def _answer(self, what):
        try:
            answer = self.answers.get(timeout=10)
        except queue.Empty:
            answer = None
        if answer is None:
            raise RuntimeError(f"no answer to {what}; vimc4 says why on standard error")
        return answer
