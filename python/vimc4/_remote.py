"""Controllers that are served elsewhere, over HTTP."""

from __future__ import annotations

import base64
import http.client
import json
import os
import socket
from datetime import timedelta
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode, urlsplit

from ._errors import Late, PortError, Refused
from ._types import Effect, FaultView, RuleView, Signal

if TYPE_CHECKING:
    from typing import Iterable, Iterator

    from ._types import Step, View

ELSE = "it answers with something else"

PATIENCE = 10.0
"""So many seconds a server may take to let somebody in."""


def connect(url: str | None = None, token: str | None = None, controller: int = 1) -> Remote:
    """A controller of a ``vimc4 serve --http`` that runs, by its number from 1.

    Without an address it is that of the environment variable VIMC4_URL, and without a token that of
    VIMC4_TOKEN, if there is one. The ``http://`` of an address may be left out.
    """
    if url is None and not (url := os.environ.get("VIMC4_URL")):
        raise PortError(
            "no address is given; give one, as in connect('http://127.0.0.1:8080'), or set VIMC4_URL: "
            "`vimc4 serve --http` prints where it listens"
        )
    return Remote(url, token or os.environ.get("VIMC4_TOKEN"), controller)


class Remote:
    """A controller that is served elsewhere. The methods are those of `Emulator`, as far as the control API
    has them; each is a request, so that threads can use them at the same time. Times are nanoseconds of the
    controller's time; a ``timeout`` counts seconds on the wall, after which what was waited for is given up.

    At the end of its ``with`` what `fault` and `scenario` have begun ends, and so does the debugger.
    """

    def __init__(self, url: str, token: str | None = None, controller: int = 1) -> None:
        wrong = f"{url!r} is no address of the API; it is as in http://127.0.0.1:8080"
        if not isinstance(url, str):
            raise TypeError(wrong)
        url = url if "://" in url else f"http://{url}"
        try:
            parts = urlsplit(url)
            self._host, self._port = parts.hostname or "", parts.port or 80
        except ValueError:
            raise PortError(wrong) from None
        has_more = "@" in parts.netloc or parts.path not in ("", "/") or parts.query or parts.fragment
        if parts.scheme != "http" or not self._host or has_more:
            raise PortError(wrong)
        self.url = url
        """Where the server is."""
        self.number = controller
        """Which of its controllers it is, from 1."""
        self._token = token
        self._begun: list[RemoteScope] = []
        self._debugs = False
        about = self.ask("GET", "")
        if not isinstance(about, dict):
            raise self._lost(ELSE)
        self.about: dict[str, Any] = about
        """What it is: its model, machine, axes and ports."""

    def controllers(self) -> list[dict[str, Any]]:
        """All controllers of the server."""
        found: list[dict[str, Any]] = self._ask("GET", "/controllers")
        return found

    def close(self) -> None:
        """Ends what `fault` and `scenario` have begun, and the debugger. The controller goes on."""
        for scope in reversed(self._begun[:]):
            scope.end()
        if self._debugs:
            self._debugs = False
            self.ask("DELETE", "/debugger")

    def __repr__(self) -> str:
        model, machine = self.about["model"], self.about["machine"]
        return f"<vimc4.Remote {self.number}: {model} on {machine}, at {self.url}>"

    def __enter__(self) -> Remote:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.close()
        except PortError:
            # The server has ended, and with it what was begun there.
            pass

    # --- requests ---

    def ask(
        self,
        method: str,
        path: str,
        fields: dict[str, Any] | None = None,
        query: dict[str, Any] | None = None,
        timeout: float | None = None,
    ) -> Any:
        """Asks the API about this controller what there is no method for: ``ask("GET", "/machine")``. What it
        answers as JSON is taken apart; a text, such as that of ``"/flash"`` and ``"/recording"``, is a `str`."""
        return self._ask(method, f"/controllers/{self.number}{path}", fields, query, timeout)

    def _ask(
        self,
        method: str,
        path: str,
        fields: dict[str, Any] | None = None,
        query: dict[str, Any] | None = None,
        timeout: float | None = None,
    ) -> Any:
        headers = {"Content-Type": "application/json"} if fields else {}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        body = json.dumps(fields) if fields else None
        there = http.client.HTTPConnection(self._host, self._port, timeout=PATIENCE)
        try:
            there.connect()
            there.sock.settimeout(timeout)
            there.request(method, f"/v1{path}" + (f"?{urlencode(query)}" if query else ""), body, headers)
            answer = there.getresponse()
            text = answer.read().decode()
            sort = answer.headers.get_content_type()
            is_json = sort == "application/json" or sort.endswith("+json")
            document = json.loads(text) if is_json else text
        except TimeoutError as error:
            if there.sock is None or timeout is None:
                raise self._lost(error) from None
            raise Late(f"{method} {path} was not done in {timeout} s") from None
        except (OSError, http.client.HTTPException) as error:
            raise self._lost(error) from None
        except ValueError:
            raise self._lost(ELSE) from None
        finally:
            # What is waited for there is given up with the connection.
            there.close()
        if answer.status >= 400:
            raise Refused(document) if isinstance(document, dict) else self._lost(ELSE)
        return document

    def _lost(self, why: object) -> PortError:
        return PortError(f"cannot talk to {self.url}: {why}; is `vimc4 serve --http` running there?")

    # --- what is seen ---

    def view(self) -> View:
        """Everything that is visible: positions, speeds, signals, ports, program."""
        view: View = self.ask("GET", "/view")
        return view

    def position(self) -> list[int]:
        """The step counters of its axes."""
        return [axis["position"] for axis in self.view()["axes"]]

    def signals(self) -> list[Signal]:
        """What can be pressed, turned and set."""
        return [_signal(row) for row in self.ask("GET", "/signals")]

    def value(self, signal: str) -> int | None:
        """The present value of a signal; None if it has no lasting one."""
        values: dict[str, int | None] = {row["name"]: row["value"] for row in self.ask("GET", "/signals")}
        return values[signal]

    # --- what is done ---

    def order(self, line: str, timeout: float | None = None) -> str:
        """Gives an order in the words of standard input, and returns what is answered."""
        text: str = self.ask("POST", "/orders", {"order": line}, timeout=timeout)["text"]
        return text

    def complete(self, begun: str) -> list[tuple[str, str]]:
        """What can follow an order that has been begun, and what it is about."""
        ways = self.ask("GET", "/completions", query={"line": begun})
        return [(way["line"], way["about"]) for way in ways]

    def send(self, data: bytes) -> None:
        """Sends bytes to the controller, as its host does. What it answers is in `journal`."""
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise TypeError(f"{data!r} cannot be sent; give bytes, as in b'@07\\r'")
        self.ask("POST", "/line", {"send": str(data, "latin-1")})

    def set_signal(self, name: str, value: int | str) -> Effect:
        """Sets a signal: a number, or the name of a switch's position."""
        return _effect(self.ask("PUT", f"/signals/{quote(name, safe='')}", {"value": value}))

    def press(self, button: str) -> str:
        """Presses a button and releases it at the same instant, unless it latches."""
        return self.order(f"press {button}")

    def hold(self, button: str) -> str:
        """Presses a button and keeps it pressed."""
        return self.order(f"hold {button}")

    def release(self, button: str) -> str:
        """Releases what is held."""
        return self.order(f"release {button}")

    def turn(self, switch: str, position: str) -> Effect:
        """Puts a switch into a position."""
        return self.set_signal(switch, position)

    def power(self, on: bool) -> str:
        """The mains switch."""
        return self.order("power on" if on else "power off")

    # --- time ---

    def now(self) -> int:
        """The controller's time."""
        now: int = self.clock()["now"]
        return now

    def clock(self) -> dict[str, Any]:
        """The time as ``now``, the ``clock``, and whether and why time is ``paused``."""
        clock: dict[str, Any] = self.ask("GET", "/clock")
        return clock

    def set_clock(self, clock: str) -> None:
        """Lets time pass at another speed, where it passes by itself: ``real``, or a factor such as ``8x``."""
        self.ask("PUT", "/clock", {"clock": clock})

    def advance(self, span: str | timedelta, timeout: float | None = None) -> int:
        """Moves time forward, as in ``"250ms"`` or by a ``timedelta``, and returns the time."""
        if isinstance(span, timedelta) and span >= timedelta():
            span = f"{span // timedelta(microseconds=1)}us"
        if not isinstance(span, str):
            raise TypeError(
                'a span of time is a text with a unit, as in "250ms", or a timedelta that is not negative'
            )
        return _now(self.ask("POST", "/clock/advance", {"span": span}, timeout=timeout))

    def run_until(self, condition: str, timeout: float | None = None) -> int:
        """Lets time pass until a condition holds, or time is paused on the way, and returns the time."""
        return _now(self.ask("POST", "/clock/run-until", {"condition": condition}, timeout=timeout))

    def run_until_idle(self, timeout: float | None = None) -> int:
        """Lets time pass until nothing moves, and returns the time."""
        return self.run_until("idle", timeout)

    def cancel_all(self) -> None:
        """Gives up all that waits for time to pass, whoever waits."""
        self.ask("POST", "/clock/cancel")

    def pause(self) -> int:
        """Lets time stand still, and returns it."""
        return _now(self.ask("POST", "/clock/pause"))

    def resume(self) -> int:
        """Lets time go on, and returns it."""
        return _now(self.ask("POST", "/clock/resume"))

    def step(self) -> Step:
        """Does the next thing only, while time is paused, and says what it was."""
        step: Step = self.ask("POST", "/clock/step")["step"]
        return step

    def break_when(self, condition: str) -> int:
        """Pauses time whenever a condition becomes true. Returns the breakpoint's number."""
        number: int = self.ask("POST", "/breakpoints", {"condition": condition})["id"]
        return number

    def remove_breakpoint(self, breakpoint: int) -> None:
        """Removes a breakpoint."""
        self.ask("DELETE", f"/breakpoints/{breakpoint}")

    def breakpoints(self) -> list[dict[str, Any]]:
        """The breakpoints: ``id``, ``condition``, and how often each was ``met``."""
        points: list[dict[str, Any]] = self.ask("GET", "/breakpoints")
        return points

    # --- what happens ---

    def journal(
        self, *kinds: str, search: str | None = None, after: int = 0
    ) -> Iterator[dict[str, Any]]:
        """What has happened, oldest first: entries of these kinds, or of all, with this text, behind
        the entry of this number."""
        query: dict[str, Any] = {"limit": 1000}
        query |= {"kinds": ",".join(kinds)} if kinds else {}
        query |= {"search": search} if search else {}
        # What is wrong with the question is said here and not at the first entry.
        return self._entries(query, self.ask("GET", "/journal", query=query | {"after": after}))

    def _entries(self, query: dict[str, Any], page: dict[str, Any]) -> Iterator[dict[str, Any]]:
        while True:
            yield from page["entries"]
            if page["next"] >= page["last"]:
                return
            page = self.ask("GET", "/journal", query=query | {"after": page["next"]})

    def events(
        self, *kinds: str, after: int | None = None, timeout: float | None = None
    ) -> Events:
        """What happens from now on, or behind the entry of this number, as it happens: an iterator, and a
        context manager. It ends with the server, and raises `Late` if nothing comes for so many seconds."""
        return Events(self, kinds, after, timeout)

    # --- what goes wrong ---

    def fault(self, words: str) -> RemoteScope:
        """Lets something go wrong: ``"drop to-host once"``. In a ``with`` it ends with that."""
        number = self.ask("POST", "/faults", {"fault": words})["number"]
        return RemoteScope(self, "faults", number)

    def faults(self) -> list[FaultView]:
        """The faults that there are."""
        return [FaultView(**row) for row in self.ask("GET", "/faults")]

    def end_faults(self) -> Effect:
        """All faults end."""
        return _effect(self.ask("DELETE", "/faults"))

    def scenario(self, rules: str) -> RemoteScope:
        """Lets things happen as rules say, one in each line: ``"when x > 1000: press stop"``. In a
        ``with`` it ends with that."""
        number = self.ask("POST", "/rules", {"rules": rules})["scenario"]
        return RemoteScope(self, "rules", number)

    def rules(self) -> list[RuleView]:
        """The rules that there are."""
        return [RuleView(**row) for row in self.ask("GET", "/rules")]

    def end_scenarios(self) -> Effect:
        """All rules end."""
        return _effect(self.ask("DELETE", "/rules"))

    def reset(self) -> Effect:
        """All rules and all faults end."""
        return _effect(self.ask("POST", "/reset"))

    # --- snapshots and the debugger ---

    def snapshot(self, name: str = "") -> int:
        """Keeps the present state. Returns its number."""
        number: int = self.ask("POST", "/snapshots", {"name": name})["id"]
        return number

    def snapshots(self) -> list[dict[str, Any]]:
        """The snapshots: ``id``, ``name``, ``at``."""
        found: list[dict[str, Any]] = self.ask("GET", "/snapshots")
        return found

    def restore(self, snapshot: int) -> int:
        """Goes back to a state, and returns its time."""
        return _now(self.ask("POST", f"/snapshots/{snapshot}/restore"))

    def forget(self, snapshot: int) -> None:
        """Forgets a snapshot."""
        self.ask("DELETE", f"/snapshots/{snapshot}")

    def debug(self, line: str, timeout: float | None = None) -> str:
        """A line of the console, and what it answers. The first one pauses time until `close`."""
        self._debugs = True
        text: str = self.ask("POST", "/debugger", {"line": line}, timeout=timeout)["text"]
        return text

    def quit(self) -> None:
        """Ends the server."""
        self._begun.clear()
        self._debugs = False
        self._ask("POST", "/quit")


class RemoteScope:
    """A fault or a scenario of a controller that is served elsewhere, until it is ended."""

    def __init__(self, remote: Remote, what: str, number: int) -> None:
        self._remote = remote
        self._what = what
        self.number = number
        """Its number."""
        remote._begun.append(self)

    def end(self) -> None:
        """It ends, if it has not yet."""
        if self in self._remote._begun:
            self._remote._begun.remove(self)
            try:
                self._remote.ask("DELETE", f"/{self._what}/{self.number}")
            except Refused as problem:
                # Somebody else has ended it.
                if problem.status != 404:
                    raise

    def __repr__(self) -> str:
        what = "Fault" if self._what == "faults" else "Scenario"
        ended = "" if self in self._remote._begun else ", ended"
        return f"<vimc4.Remote{what} {self.number} of {self._remote.number} at {self._remote.url}{ended}>"

    def __enter__(self) -> RemoteScope:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


class Events:
    """What happens at a controller that is served elsewhere, as it happens."""

    def __init__(
        self, remote: Remote, kinds: Iterable[str], after: int | None, timeout: float | None
    ) -> None:
        self._remote = remote
        self._timeout = timeout
        self._ready: list[dict[str, Any]] = []
        wish: dict[str, Any] = {"controllers": [remote.number]}
        wish |= {"kinds": list(kinds)} if kinds else {}
        wish |= {"after": {str(remote.number): after}} if after is not None else {}
        wish |= {"token": remote._token} if remote._token else {}
        try:
            self._socket = socket.create_connection((remote._host, remote._port), PATIENCE)
        except OSError as error:
            raise remote._lost(error) from None
        self._received = bytearray()
        self._text = b""
        try:
            self._shake_hands()
            self._send(1, json.dumps(wish).encode())
            # What happens from here on is not missed.
            self._take(self._message())
            self._socket.settimeout(timeout)
        except StopIteration:
            raise remote._lost("it has hung up") from None
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Nobody listens any more."""
        self._socket.close()

    def __enter__(self) -> Events:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Events:
        return self

    def __next__(self) -> dict[str, Any]:
        while not self._ready:
            self._take(self._message())
        return self._ready.pop(0)

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "problem":
            raise Refused(message)
        if message["type"] == "gap":
            self._ready.append({"kind": "gap", "from": message["from"], "to": message["to"]})
        self._ready += message.get("entries", [])

    # --- as RFC 6455 has it ---

    def _shake_hands(self) -> None:
        key = base64.b64encode(os.urandom(16)).decode()
        host = urlsplit(self._remote.url).netloc
        self._socket.sendall(
            f"GET /v1/events HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
        )
        while b"\r\n\r\n" not in self._received:
            self._receive()
        head, _, rest = bytes(self._received).partition(b"\r\n\r\n")
        if not head.startswith(b"HTTP/1.1 101 "):
            raise self._remote._lost("it has no events")
        self._received = bytearray(rest)

    def _send(self, sort: int, data: bytes) -> None:
        """Sends a frame, which clients have to mask."""
        size = len(data)
        length = bytes([0x80 | size]) if size < 126 else b"\xfe" + size.to_bytes(2, "big")
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[place % 4] for place, byte in enumerate(data))
        self._socket.sendall(bytes([0x80 | sort]) + length + mask + masked)

    def _message(self) -> dict[str, Any]:
        """The next message. The end of the connection ends the iteration."""
        while True:
            first, data = self._frame()
            sort = first & 0x0F
            if sort == 8:
                self.close()
                raise StopIteration
            if sort == 9:
                self._send(10, data)
            if sort in (0, 1):
                self._text += data
                if first & 0x80:
                    message: dict[str, Any] = json.loads(self._text)
                    self._text = b""
                    return message

    def _frame(self) -> tuple[int, bytes]:
        """The first byte of the next frame, and its data. It is taken when it is whole: whoever has not waited
        long enough may try again."""
        while True:
            had = self._received
            if len(had) >= 2:
                size = had[1] & 0x7F
                begin = {126: 4, 127: 10}.get(size, 2)
                if len(had) >= begin:
                    end = begin + (size if size < 126 else int.from_bytes(had[2:begin], "big"))
                    if len(had) >= end:
                        frame = had[0], bytes(had[begin:end])
                        del had[:end]
                        return frame
            self._receive()

    def _receive(self) -> None:
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            raise Late(f"nothing has happened in {self._timeout} s") from None
        except OSError:
            # It was closed, here or there.
            data = b""
        if not data:
            self.close()
            raise StopIteration
        self._received += data


def _now(answer: dict[str, Any]) -> int:
    now: int = answer["now"]
    return now


def _effect(answer: dict[str, Any]) -> Effect:
    return Effect(answer["effect"] == "something", answer.get("why"))


def _signal(row: dict[str, Any]) -> Signal:
    kind, low, high = row["kind"], 0, 1
    if isinstance(kind, dict):
        [(kind, span)] = kind.items()
        low, high = span["low"], span["high"]
    names = row["positions"]
    return Signal(
        name=row["name"],
        kind=kind,
        low=low,
        high=high,
        positions=(names[0], names[1]) if names else None,
        latches=row["latches"],
        bits=[(port, bit) for port, bit in row["bits"]],
        terminal=row["terminal"],
        about=row["about"],
    )
