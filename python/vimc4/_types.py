"""What emulators tell of themselves: small named tuples, and pictures as plain dicts.

The pictures have the same names and values as their JSON elsewhere, so that
``json.dumps(emulator.view())`` is what other tools write. Times are nanoseconds, whole numbers.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, TypedDict


class Command(NamedTuple):
    """A command that the host sent."""

    at: int
    """When its execution began, in nanoseconds."""
    number: int | None
    """Its number, which its answer and all that comes of it carry too."""
    mnemonic: str
    """The stable mnemonic, such as ``@A`` or ``0``; ``?`` for a line that no command matches."""
    bytes: bytes
    """The line as it was received, without its end."""
    text: str
    """What people call it: ``relative move X +5,000 steps at 900 Hz``."""


class Effect(NamedTuple):
    """What came of something that was done. It is true if anything has changed."""

    changed: bool
    """Whether something is not as it was before, or was said."""
    why: str | None
    """Why nothing has changed, as far as that is known."""

    def __bool__(self) -> bool:
        return self.changed


class Signal(NamedTuple):
    """A thing of the outside world that can be set."""

    name: str
    """Its name, lower case: ``start``, ``cover``, ``input 0.3``."""
    kind: Literal["button", "switch", "input", "analogue"]
    """What it is."""
    low: int
    """Its smallest value."""
    high: int
    """Its largest value."""
    positions: tuple[str, str] | None
    """For a switch, the names of the values 0 and 1."""
    latches: bool
    """For a button, whether it stays pressed until it is released."""
    bits: list[tuple[int, int]]
    """The port bits by which the controller reads it: port and bit, the usual one first."""
    terminal: str | None
    """For a user input, the terminal it is wired to, as profiles name it."""
    about: str
    """What it does, in a few words."""


class FaultView(NamedTuple):
    """A fault that an emulator has."""

    number: int
    """Its number."""
    fault: str
    """What it is, as people type it."""
    stage: Literal["waits", "strikes", "over"]
    """Whether it waits for something, strikes when there is something to strike, or is over."""
    struck: int
    """How often it has struck."""


class RuleView(NamedTuple):
    """A rule that an emulator has."""

    scenario: int
    """The number of its scenario."""
    place: int
    """Which of the scenario's rules it is, from 1."""
    name: str | None
    """Its name, if it has one."""
    rule: str
    """What it is, as people type it."""
    stage: Literal["waits", "holds", "over"]
    """Whether it waits, holds what it has changed, or has acted as often as it was to."""
    acted: int
    """How often it has acted."""


class Move(NamedTuple):
    """A motion: where it led, and the box that it stayed in. Places are in steps, X first."""

    command: int | None
    """The number of the command that it belongs to."""
    began: int
    """When it began, in nanoseconds."""
    ended: int | None
    """When it ended; None if it has not yet: the rest is then as it will be."""
    start: list[int]
    """Where the counters were at its beginning."""
    end: list[int]
    """Where they were at its end."""
    low: list[int]
    """The smallest that each was."""
    high: list[int]
    """The largest that each was."""
    steps: int
    """How many steps of the step clock it had."""


class Pause(NamedTuple):
    """Time is paused."""

    at: int
    """The controller's time when it was paused, in nanoseconds."""
    by: str | None
    """Who has paused it; None if it was a breakpoint."""
    breakpoints: list[int]
    """The breakpoints that were met."""


class Breakpoint(NamedTuple):
    """A breakpoint as it stands."""

    id: int
    """Its number."""
    condition: str
    """The condition at which time is paused, whenever it becomes true."""
    met: int
    """How often that has been."""


class Progress(NamedTuple):
    """How far a journey through time has come."""

    now: int
    """The controller's time, in nanoseconds."""
    to: int | None
    """Where time goes; None as long as that is not known."""
    paused: bool
    """Whether it is held up."""


Step = Literal["cause", "input", "time", "rest"]
"""What a step has done while time is paused: one thing that the controller does by itself; taken an
input that had waited; nothing but let time pass, up to where a breakpoint is met; nothing at all."""


class Axis(TypedDict):
    """One axis."""

    index: int
    name: str
    configured: bool
    position: int
    carriage: int
    referenced: bool
    zero: int
    speed: int


class SignalView(TypedDict):
    """A signal and its value; None for what only acts in the moment it is set."""

    id: int
    name: str
    value: int | None


class PortView(TypedDict):
    """One port."""

    port: int
    input: bool
    value: int


class Timer(TypedDict):
    """Something that will happen by itself, and when."""

    cause: str
    due: int


class Fill(TypedDict):
    """How full a buffer is, in bytes."""

    used: int
    size: int


class View(TypedDict):
    """A picture of a controller."""

    at: int
    model: str
    machine: str
    powered: bool
    activity: str
    waits_for: str | dict[str, Any] | None
    baud: int
    received: Fill
    axes: list[Axis]
    signals: list[SignalView]
    ports: list[PortView]
    timers: list[Timer]
    details: dict[str, Any]


Harm = Literal[
    "dropped", "garbled", "misread", "duplicated", "delayed", "stop", "emergency-stop", "limit-switch",
    "power-off", "lost-steps",
]  # fmt: skip
"""What goes wrong in a sweep."""

Ending = Literal["returned", "raised", "asserted", "unmet", "hung"]
"""How a run of a driver has ended: ``asserted`` if only an assertion of its test failed."""

Mode = Literal["transient", "persistent", "compound"]
"""How it goes wrong: once, from then on, or once with a second fault while the driver recovers."""


class CoverageTotal(TypedDict):
    """How much of something was met."""

    met: int
    possible: int


class CoverageTotals(TypedDict):
    """How much was met of each kind."""

    commands: CoverageTotal
    answers: CoverageTotal
    states: CoverageTotal
    stops: CoverageTotal


class CoveragePoint(TypedDict):
    """One thing that can be met, and how often it was. ``about``, which says more about it, may be
    missing."""

    name: str
    met: int


class CoveredCommand(TypedDict):
    """One form of a command."""

    mnemonic: str
    title: str
    section: str
    answers: list[CoveragePoint]
    states: list[CoveragePoint]
    stops: list[CoveragePoint]


Event = dict[str, Any]
"""Something that happened: ``at`` and the number of its ``command``, under ``event`` its kind, and
what that kind has besides. ``match`` takes it apart well."""

Report = dict[str, Any]
"""Something that happened to a ``controller``, ``at`` a time, and ``what``."""
