"""Every fault that can strike a driver, one after the other."""

from __future__ import annotations

import ctypes
import json
import os
import threading
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator, NamedTuple

from . import _vimc4
from ._emulator import Emulator
from ._errors import Error

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._types import Harm, Mode

Drive = Callable[[Emulator], object]

AT_ONCE = 32
"""How many points a worker gets at a time."""


class GivenUp(BaseException):
    """A driver waits for what never comes. It is not meant to be caught."""


class Broken(NamedTuple):
    """What came of some of the points, and the smallest case of it."""

    title: str
    """What the driver does, in a few words."""
    bad: bool
    """Whether that is wrong."""
    points: int
    """How many points have led to it."""
    point: int
    """The number of the smallest case, for ``Sweep.again``."""
    broken: str
    """What was broken there."""
    heard: str
    """What the driver heard."""
    did: str
    """What it did."""
    machine: str
    """How the machine stood in the end."""
    should: str | None
    """What the driver should have noticed and done."""

    def __str__(self) -> str:
        lines = [
            f"{self.title} ({self.points} of the points; the smallest is number {self.point})",
            f"  broken: {self.broken}",
            f"  heard: {self.heard}",
            f"  did: {self.did}",
            f"  machine: {self.machine}",
        ]
        if self.should is not None:
            lines.append(f"  should: {self.should}")
        return "\n".join(lines)


class Swept(Error, AssertionError):
    """A driver does something wrong where something goes wrong."""


class _Tried(Emulator):
    """An emulator that a driver is tried with. Time passes while one of its ports is read, and at once; a
    time-out is over as soon as nothing can come any more."""

    _tried = True


class _Task(NamedTuple):
    """What a worker needs, wherever it is."""

    drive: Drive
    model: str | os.PathLike[str]
    machine: str | os.PathLike[str]
    given: str
    choice: str
    limit: float


class Sweep:
    """What came of a sweep."""

    def __init__(self, task: _Task, session: _vimc4.SweepSession) -> None:
        self._task = task
        self._session = session
        self._results = _vimc4.SweepResults(session)

    @property
    def points(self) -> int:
        """How many points there are at which something can go wrong."""
        return self._session.points

    @property
    def outcomes(self) -> list[Broken]:
        """What came of them, the worst first."""
        return [Broken(**group) for group in self._results.groups()]

    @property
    def bad(self) -> list[Broken]:
        """The outcomes in which the driver does something wrong."""
        return [outcome for outcome in self.outcomes if outcome.bad]

    def check(self) -> None:
        """Raises an AssertionError if the driver does something wrong anywhere."""
        if bad := self.bad:
            raise Swept("\n\n".join(map(str, bad)))

    def lines(self) -> str:
        """Everything as lines of JSON, as ``vimc4 sweep`` keeps it: the same, whoever has done the work in
        whatever order."""
        return self._results.lines()

    def again(self, point: int) -> None:
        """Tries a point once more, in this thread: for a debugger."""
        with _Tried(self._task.model, self._task.machine, "manual", record=False, coverage=False) as emulator:
            self._session.begin(emulator._core, point)
            self._task.drive(emulator)

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.outcomes))


def sweep(
    drive: Drive,
    model: str | os.PathLike[str] = "imc4",
    machine: str | os.PathLike[str] = "bench",
    *,
    executor: Executor | None = None,
    harms: Sequence[Harm] | None = None,
    modes: Sequence[Mode] | None = None,
    shard: tuple[int, int] = (1, 1),
    known: str = "",
    limit: float = 60.0,
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """Tries a driver once without a fault, and then once for each point at which something can go wrong:
    each byte each way, each command, each part of a motion.

    :param drive: gets an emulator and uses it; it reports success by returning, and an error by raising
    :param model: a built-in name or a profile file
    :param machine: a built-in name or a profile file
    :param executor: any of ``concurrent.futures``, also of Dask; this thread if there is none. Where it
        has other processes they must be able to import ``drive``
    :param harms: what goes wrong; see `vimc4 sweep --help`
    :param modes: ``transient``, ``persistent`` and ``compound``, or some of them
    :param shard: (3, 16) does the third of sixteen equal parts
    :param known: lines of an earlier `Sweep`, of another shard or of one that was interrupted
    :param limit: after so many seconds a driver counts as one that hangs
    :param progress: called with how many points are done and how many there are to do
    """
    choice: dict[str, Any] = {
        "harms": list(harms or HARMS), "modes": list(modes or MODES), "live": True,
    }  # fmt: skip
    number, count = shard
    if not 1 <= number <= count:
        raise ValueError(f"{number}/{count} is no part; the first of sixteen is (1, 16)")
    task = _Task(drive, model, machine, "[]", json.dumps(choice), limit)
    code, given = _run(task, None, 0)
    if code != 0:
        what = "does not end" if code is None else "raises an error"
        raise Error(f"the driver {what} although nothing is broken; mend that first")
    task = task._replace(given=given)
    result = Sweep(task, _session(task))
    results = result._results
    results.read(known)
    mine = [point for point in range(number - 1, result.points, count) if not results.has(point)]
    done = 0
    for judged in _everywhere(executor, task, mine):
        for line in judged:
            results.add(line)
        done += len(judged)
        if progress is not None:
            progress(done, len(mine))
    return result


HARMS = (
    "dropped", "garbled", "duplicated", "delayed", "stop", "emergency-stop", "limit-switch", "power-off",
)  # fmt: skip
"""What goes wrong if nothing else is said; ``misread`` and ``lost-steps``, which no answer tells, can be
asked for."""

MODES = ("transient", "persistent", "compound")


def _everywhere(
    executor: Executor | None, task: _Task, points: list[int]
) -> Iterator[list[str]]:
    parts = [points[at : at + AT_ONCE] for at in range(0, len(points), AT_ONCE)]
    if executor is None:
        for part in parts:
            yield _try(task, part)
        return
    waiting: set[Future[list[str]]] = {executor.submit(_try, task, part) for part in parts}
    try:
        while waiting:
            done, waiting = _first(waiting)
            for future in done:
                yield future.result()
    finally:
        for future in waiting:
            future.cancel()


def _first(
    waiting: set[Future[list[str]]],
) -> tuple[set[Future[list[str]]], set[Future[list[str]]]]:
    done, others = wait(waiting, return_when=FIRST_COMPLETED)
    return set(done), set(others)


def _session(task: _Task) -> _vimc4.SweepSession:
    return _vimc4.SweepSession(task.model, task.machine, task.given, task.choice)


def _try(task: _Task, points: Iterable[int]) -> list[str]:
    """Tries some points, in whatever process this is."""
    session = _session(task)
    judged = []
    for point in points:
        code, given = _run(task, session, point)
        judged.append(session.judge(point, given, code))
    return judged


def _run(task: _Task, session: _vimc4.SweepSession | None, point: int) -> tuple[int | None, str]:
    """Runs a driver once. Says how it has ended, None if it has not, and what it has given."""
    with _Tried(task.model, task.machine, "manual", record=False, coverage=False) as emulator:
        if session is not None:
            session.begin(emulator._core, point)
        codes: list[int | None] = []

        def run() -> None:
            try:
                task.drive(emulator)
                codes.append(0)
            except GivenUp:
                codes.append(None)
            except BaseException:
                codes.append(1)

        driver = threading.Thread(target=run, name="vimc4 driver", daemon=True)
        driver.start()
        driver.join(task.limit)
        hung = driver.is_alive()
        given = emulator._core.given().wait()
        if hung:
            _end(driver)
    return (None if hung or not codes else codes[0]), given


def _end(driver: threading.Thread) -> None:
    """Ends a thread that goes round and round: it hears of it as soon as it is in Python."""
    if driver.ident is not None:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(driver.ident), ctypes.py_object(GivenUp)
        )
    driver.join(10)
