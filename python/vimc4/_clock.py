"""The clock of a driver in a sweep: what it waits for in vain passes at once, also for the controller."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, Any, Callable, Iterator, TypeVar

from ._errors import ControlError

if TYPE_CHECKING:
    from . import _vimc4
    from ._emulator import Emulator

_T = TypeVar("_T")

LONGEST = 3600.0
"""A driver that has waited in vain for so many seconds of its clock waits for ever."""

FOREVER = 60.0
"""A read without a timeout is given up after so many seconds in which nothing moves."""

MOMENT = 0.001
"""A read that does not wait takes so many seconds in vain."""

PATIENCE = 2.0
"""How many seconds on the wall a controller has for an answer, at least."""


class GivenUp(BaseException):
    """A driver waits for what never comes. It is not meant to be caught."""


class TooSlow(GivenUp):
    """A driver takes longer than its time limit."""


class _Driver(threading.local):
    """What the thread of a driver knows."""

    emulator: Emulator | None = None
    waited = 0.0
    threads = 0


_driver = _Driver()


def drives(emulator: Emulator | None) -> None:
    """This thread drives an emulator from now on, or none any more."""
    _driver.emulator, _driver.waited, _driver.threads = emulator, 0.0, threading.active_count()


def waited(seconds: float) -> None:
    """This thread has waited so many seconds in vain, which has taken no time."""
    if _driver.emulator is None:
        return
    _driver.waited += seconds
    if _driver.waited > LONGEST:
        raise GivenUp(f"it has waited {LONGEST:g} s in vain")


def _sleeping(real: Callable[[float], None]) -> Callable[[float], None]:
    def sleep(seconds: float) -> None:
        emulator = _driver.emulator
        if emulator is None or emulator.closed or seconds < 0:
            return real(seconds)
        # Other threads of the driver work meanwhile.
        is_alone = threading.active_count() <= _driver.threads
        real(0 if is_alone else seconds)
        emulator._core.advance(timedelta(seconds=seconds)).wait()
        if is_alone:
            waited(seconds)

    return sleep


def _shifted(real: Callable[[], Any], one_second: int) -> Callable[[], Any]:
    def clock() -> Any:
        now = real()
        return now + type(now)(_driver.waited * one_second)

    return clock


_REAL: list[Any] = [
    time.sleep, time.monotonic, time.perf_counter, time.time,
    time.monotonic_ns, time.perf_counter_ns, time.time_ns,
]  # fmt: skip
_SWEPT = [_sleeping(_REAL[0]), *(_shifted(it, 1) for it in _REAL[1:4]), *(_shifted(it, 10**9) for it in _REAL[4:])]

_lock = threading.Lock()
_sweeps = 0


@contextmanager
def swept_clock() -> Iterator[None]:
    """As long as this lasts, `time` and all that is imported from it have the clock of the driver in its thread; in
    all other threads nothing differs."""
    global _sweeps
    with _lock:
        _sweeps += 1
        if _sweeps == 1:
            _exchange(_REAL, _SWEPT)
    try:
        yield
    finally:
        with _lock:
            _sweeps -= 1
            if _sweeps == 0:
                _exchange(_SWEPT, _REAL)


def _exchange(old: list[Any], new: list[Any]) -> None:
    others = {id(one): other for one, other in zip(old, new)}
    for module in list(sys.modules.values()):
        names = getattr(module, "__dict__", {})
        for name, value in list(names.items()):
            if id(value) in others:
                names[name] = others[id(value)]


class SweptLine:
    """The line to a controller in a sweep. The line itself lets time pass up to the answer, or until nothing moves any
    more; a read in vain then lets its timeout pass."""

    def __init__(self, line: _vimc4.Port, emulator: Emulator) -> None:
        self._line, self._emulator = line, emulator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._line, name)

    def read(self, size: int = 1, timeout: float | None = None) -> bytes:
        if timeout is None:
            try:
                return self._line.read(size)
            except GivenUp:
                self._pass(FOREVER)
                return self._line.read(size)
        # Nothing of that passes on the wall, where the controller may have to wait for a processor.
        data = self._line.read(size, max(timeout, PATIENCE))
        if len(data) < size and not self._line.ended:
            self._pass(timeout)
            data += self._line.read(size - len(data), PATIENCE)
            if len(data) < size:
                waited(max(timeout, MOMENT))
        return data

    @property
    def in_waiting(self) -> int:
        count = self._line.in_waiting
        if count == 0 and not self._line.ended:
            self._pass(MOMENT)
            count = self._line.in_waiting
            if count == 0:
                waited(MOMENT)
        return count

    def _pass(self, seconds: float) -> None:
        span = timedelta(seconds=min(max(seconds, MOMENT), LONGEST))
        try:
            self._emulator._core.advance(span).wait()
        except ControlError:
            # The next read says what has ended.
            pass


class Limit:
    """How many seconds a run may take. One that nobody has set grows while all runs are slow, for the computer may be
    busy with something else, and a run that exceeds it is tried once more."""

    def __init__(self, least: float, grows: bool) -> None:
        self._least, self._grows, self._slowest = least, grows, 0.0

    def now(self) -> float:
        return max(self._least, 3 * self._slowest)

    def tries(self, run: Callable[[float], _T], is_slow: Callable[[_T], bool]) -> _T:
        """What comes of a run that gets the limit."""
        began = time.perf_counter()
        ran = run(self.now())
        if self._grows and is_slow(ran):
            began = time.perf_counter()
            ran = run(self.now())
        if self._grows and not is_slow(ran):
            self._slowest = max(self._slowest, time.perf_counter() - began)
        return ran
