"""What can go wrong. The words are those of the library in Rust."""

from __future__ import annotations


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


class ControlError(Error):
    """A running emulator does not do what it was told."""


class Ended(ControlError):
    """It runs no longer."""


class DeedError(ControlError, ValueError):
    """It has no such button, switch, signal or input, or no such value of it."""


class Never(ControlError):
    """What is waited for never happens unless something else does first, or not as far as is looked
    ahead."""


class Late(ControlError, TimeoutError):
    """What was waited for has not happened in so many seconds on the wall."""


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
