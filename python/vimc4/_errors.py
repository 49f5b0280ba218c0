"""What can go wrong. The words are those of the library in Rust."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing import Literal


ELSEWHERE = (
    "the emulator lives in the process that has started it, and this is a copy of that; connect from here "
    "over its pseudo-terminal or TCP"
)
"""What `Ended` says in a forked process."""


class Error(Exception):
    """Something that an emulator cannot do. All others are this one, too."""


class ProfileError(Error, ValueError):
    """There is no such model or machine, or its profile is wrong."""


class PortError(Error, OSError):
    """An address, a pseudo-terminal or a serial port cannot be had."""


class FlashError(Error, OSError):
    """The file of the flash memory cannot be used."""


class RecordingError(Error, OSError):
    """The recording cannot be begun."""


class ConditionError(Error, ValueError):
    """A text is no condition. It says where it goes wrong, and what would be right there."""


class OrderError(Error, ValueError):
    """A text is not an order. It says where it goes wrong, and what would be right there."""


class CoverageError(Error, ValueError):
    """It is no coverage, or not of the same model."""


class CoverageFileError(Error, OSError):
    """A file of coverage cannot be read or written."""


class FaultError(Error, ValueError):
    """A text describes no fault. It says where it goes wrong, and what would be right there."""


class ScenarioError(Error, ValueError):
    """A text or a file has no rules. It says where it goes wrong, and what would be right there."""


class Mistake(Error, ValueError):
    """What is expected could never be met, or never fail."""


class Unmet(Error, AssertionError):
    """What was expected is not met: what is wrong, what came closest, and what happened around it."""

    expected: str
    """The expectation in words."""
    reason: Literal[
        "missing", "too-often", "too-early", "too-late", "not-held", "not-followed", "never-came",
        "forgotten",
    ]  # fmt: skip
    """Which sort of failure it is, for programs."""
    but: str
    """What is wrong, in words."""
    at: int
    """When that was clear, in nanoseconds."""
    entry: int | None
    """The number of the entry of the journal in which it shows, if it shows in one."""
    closest: list[str]
    """What came closest, and in what it differs."""
    around: list[str]
    """What happened around it, in the words of the log."""
    place: str | None = None
    """Where the sentence begins: the file and the line, where that is known."""

    def __init__(self, text: str, told: dict[str, Any]) -> None:
        super().__init__(text, told)
        self.expected = told["expected"]
        self.reason = told["reason"]
        self.but = told["but"]
        self.at = told["at"]
        self.entry = told.get("entry")
        self.closest = told.get("closest", [])
        self.around = told["around"]

    def __str__(self) -> str:
        return str(self.args[0])


class Unfinished(Error, AssertionError):
    """A sentence about what is expected was begun and has no end, so that nobody looks."""

    place: str
    """Where it begins: the file and the line."""

    def __init__(self, place: str) -> None:
        super().__init__(place)
        self.place = place

    def __str__(self) -> str:
        return (
            f"the sentence that begins at {self.place} has no end, so nobody looks whether it is so: end "
            "it with watch() or so_far()"
        )


class ControlError(Error):
    """A running emulator does not do what it was told."""


class Ended(ControlError):
    """It runs no longer."""


class DeedError(ControlError, ValueError):
    """It has no such button, switch, signal, input or command, or no such value of it."""


class Never(ControlError):
    """What is waited for never happens unless something else does first, or not as far as is looked
    ahead."""


class Late(ControlError, TimeoutError):
    """What was waited for has not happened in so many seconds on the wall."""


class Refused(Error):
    """A server of controllers does not do what it was asked for: a problem document."""

    title: str
    """Which sort of problem it is, in words."""
    kind: str
    """The same for programs: ``not-understood``, ``not-now``, ``no-such-thing``, ``no-token``, …"""
    detail: str
    """What is wrong."""
    remedy: str
    """What would be right; empty if there is nothing to say."""
    status: int
    """The status of HTTP."""

    def __init__(self, problem: dict[str, Any]) -> None:
        super().__init__(problem)
        # On a WebSocket the type of the message stands in its place.
        kind = problem["kind"] if problem.get("type") == "problem" else problem.get("type", "")
        self.kind = str(kind).rpartition("#")[2]
        self.title = problem.get("title", "")
        self.detail = problem.get("detail", "")
        self.remedy = problem.get("remedy", "")
        self.status = problem.get("status", 0)

    def __str__(self) -> str:
        return "; ".join(part for part in (self.detail or self.title, self.remedy) if part)


class Endless(Error):
    """A controller in virtual time goes on and on, and is not at rest."""


class Cancelled(ControlError):
    """Time was on its way, and somebody has given that up."""

    at: int
    """The controller's time then, in nanoseconds."""

    def __init__(self, text: str, at: int) -> None:
        super().__init__(text, at)
        self.at = at

    def __str__(self) -> str:
        return str(self.args[0])


class LineWarning(UserWarning):
    """Something on the line that this one understands, and a real controller would not."""


class RecordingWarning(UserWarning):
    """A recording could not be written to its end."""
