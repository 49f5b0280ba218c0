"""Every fault that can strike a driver, one after the other."""

from __future__ import annotations

import ctypes
import functools
import inspect
import json
import math
import operator
import os
import sys
import threading
import time
import traceback
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from numbers import Real
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator, NamedTuple, NoReturn, cast

from . import _vimc4
from ._clock import GivenUp, Limit, SweptLine, drives, swept_clock
from ._emulator import Emulator
from ._errors import Error, Unfinished, Unmet
from ._named import named
from ._scope import Marks

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._types import Ending, Harm, Mode

Drive = Callable[[Emulator], object]

AT_ONCE = 32
"""How many points a worker gets at a time."""


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


def outcomes(results: _vimc4.SweepResults) -> list[Broken]:
    """The outcomes in the words of Python: what has no exit code returns, or raises an error."""
    words = (("exit code 0: success", "it returned"), ("exit code 1: an error", "it raised an error"))
    told = []
    for group in results.groups():
        broken = Broken(**group)
        for code, word in words:
            broken = broken._replace(did=broken.did.replace(code, word))
        told.append(broken)
    return told


class Swept(Error, AssertionError):
    """A driver does something wrong where something goes wrong."""


class Unsweepable(Error):
    """What is to be swept uses its controller in a way in which no time passes."""


class _Tried(Emulator):
    """An emulator that a driver is tried with. Time passes while one of its ports is read or the driver sleeps, and
    takes none on the wall."""

    _tried = True

    def __init__(self, *args: Any, **options: Any) -> None:
        for option, way in OUTSIDE.items():
            if options.get(option) not in (None, False):
                raise Unsweepable(
                    f"it opens the controller over {way}, and in a sweep time passes only while a port from serial() "
                    "or connect() is read; open one of these, or sweep the program with `vimc4 sweep -- COMMAND`"
                )
        super().__init__(*args, **options)

    def _connect(self) -> _vimc4.Port:
        return cast("_vimc4.Port", SweptLine(super()._connect(), self))

    @property
    def aio(self) -> NoReturn:
        raise Unsweepable(AWAITS)

    def close(self) -> None:
        if not self.closed:
            # What the driver has written last has arrived, also if it is the driver that ends it.
            self._core.given().wait()
        super().close()


OUTSIDE = {"pty": "a pseudo-terminal", "tcp": "TCP", "rfc2217": "RFC 2217", "serial": "a real serial port"}
"""Ways to a controller on which nothing says when somebody waits for it."""

AWAITS = (
    "it awaits its controller, and in a sweep time passes only while a port from serial() or connect() is read; "
    "sweep a test or a driver without `async`"
)


class _Task(NamedTuple):
    """What a worker needs, wherever it is."""

    drive: Drive
    model: str | os.PathLike[str]
    machine: str | os.PathLike[str]
    given: str
    choice: str
    limit: float
    grows: bool
    """Whether the limit may grow: nobody has set it."""
    name: str
    """What tells the driver from others, before it has run."""


class _Ran(NamedTuple):
    """A run of a driver."""

    ending: Ending
    """How it has ended."""
    given: str
    """What it has given."""
    error: BaseException | None = None
    is_slow: bool = False
    """Whether it has exceeded its limit."""


class Sweep:
    """What came of a sweep."""

    def __init__(self, task: _Task, session: _vimc4.SweepSession) -> None:
        self._task = task
        self._session = session
        self._results = _vimc4.SweepResults(session, task.name)

    @property
    def points(self) -> int:
        """How many points there are at which something can go wrong."""
        return self._session.points

    @property
    def outcomes(self) -> list[Broken]:
        """What came of them, the worst first."""
        return outcomes(self._results)

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
        point = whole(point, "point; give the number of one, from 0 on")
        if not 0 <= point < self.points:
            raise ValueError(f"there is no point {point}; there are {self.points}, from 0 on")
        with swept_clock(), _Tried(self._task.model, self._task.machine, "manual", coverage=False) as emulator:
            self._session.begin(emulator._core, point)
            drives(emulator)
            try:
                self._task.drive(emulator)
            finally:
                drives(None)

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.outcomes))

    def __repr__(self) -> str:
        return f"<vimc4.Sweep of {self._task.name}: {summary(self.points, self.outcomes)}>"


def sweep(
    drive: Drive,
    model: str | os.PathLike[str] = "imc4",
    machine: str | os.PathLike[str] = "bench",
    *,
    executor: Executor | None = None,
    harms: Harm | Sequence[Harm] | None = None,
    modes: Mode | Sequence[Mode] | None = None,
    shard: tuple[int, int] = (1, 1),
    known: str = "",
    limit: float | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """Tries a driver once without a fault, and then once for each point at which something can go wrong:
    each byte each way, each command, each part of a motion.

    :param drive: gets an emulator and uses it; it reports success by returning, and an error by raising. Its own
        ``assert`` is an error only if it is about the first wrong answer itself: an assertion about the position at
        the end does not count as noticed. An expectation that is not met after the driver has gone on is something
        wrong. The driver is run twice without a fault, and has to send the same
    :param model: a built-in name or a profile file
    :param machine: a built-in name or a profile file
    :param executor: any of ``concurrent.futures``, also of Dask; this thread if there is none. Where it
        has other processes they must be able to import ``drive``
    :param harms: what goes wrong, one or several; see `vimc4 sweep --help`
    :param modes: ``transient``, ``persistent`` and ``compound``, or some of them
    :param shard: (3, 16) does the third of sixteen equal parts
    :param known: lines of an earlier `Sweep`, of another shard or of one that was interrupted. Those of another
        driver, model, machine, harms or modes are refused. A driver is told from others by its name and by what
        it carries: the arguments of a partial, the attributes of an object, the variables of a closure; what its
        text says is not compared, and of a lambda its line counts
    :param limit: after so many seconds a driver counts as one that hangs; without it after twenty times as
        long as it takes without a fault, at least two seconds, and three times as long as the slowest run so far. One
        that waits for something else than its port is left behind as a thread of the background
    :param progress: called with how many points are done and how many there are to do
    """
    if not is_done_when_it_returns(drive):
        raise TypeError(
            f"{drive!r} cannot be called and be done when it returns; give a function that gets an emulator"
        )
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise TypeError(f"{executor!r} is no executor; give one of concurrent.futures")
    try:
        number, count = (whole(one, "part") for one in shard)
    except (TypeError, ValueError):
        number, count = 0, 0
    if not 1 <= number <= count:
        shown = f"{number}/{count}" if count else repr(shard)
        raise ValueError(f"{shown} is no part; the first of sixteen is (1, 16)")
    name, unclear = named(drive)
    if known and unclear is not None:
        raise ValueError(
            f"`known` may be from another driver: nothing can be said of {unclear} that {name} carries; give a function "
            "of a module, or a functools.partial of one with plain values"
        )
    task = _Task(drive, model, machine, "[]", chosen(harms, modes), patience(limit), limit is None, name)
    began = time.monotonic()
    clean = []
    for _ in range(2):
        with swept_clock():
            ran = _run(task, None, 0, task.limit)
        if isinstance(ran.error, Unsweepable):
            raise ran.error
        if ran.ending != "returned":
            if ran.ending == "hung":
                raise Error(f"the driver {unended(task.limit, limit)}")
            raise Error(f"the driver raises {ran.error!r} although nothing is broken; mend that first") from ran.error
        clean.append(ran.given)
    if limit is None:
        task = task._replace(limit=longest((time.monotonic() - began) / 2))
    task = task._replace(given=clean[0])
    result = Sweep(task, begun_twice(task.model, task.machine, clean, task.choice))
    results = result._results
    try:
        results.read(known)
    except ValueError as error:
        raise ValueError(f"`known` is not from this sweep: {error}") from None
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

ASKED_FOR = ("misread", "lost-steps")

PATIENCE = 60.0
"""How many seconds a driver may take without a fault."""


def patience(limit: float | None) -> float:
    """How many seconds a driver may take while nobody knows how long it takes."""
    if limit is None:
        return PATIENCE
    if isinstance(limit, bool) or not isinstance(limit, Real):
        raise TypeError(f"{limit!r} is no limit; give a number of seconds")
    if not 0 < limit < math.inf:
        raise ValueError(f"{limit!r} is no limit; give a finite number of seconds above 0")
    return min(float(limit), threading.TIMEOUT_MAX)


def unended(patience: float, limit: float | None) -> str:
    """A run without a fault has not ended in so many seconds."""
    remedy = "mend that first" if limit is None else "give a greater limit, or none"
    return f"has not ended after {patience:g} s although nothing is broken; {remedy}"


def whole(number: Any, what: str) -> int:
    """A whole number; True and False are none."""
    if isinstance(number, bool) or not hasattr(number, "__index__"):
        raise TypeError(f"{number!r} is no {what}")
    return operator.index(number)


def longest(clean: float) -> float:
    """How many seconds a driver may take that takes so many without a fault."""
    return max(2.0, 20 * clean)


def summary(points: int, found: list[Broken]) -> str:
    """How much was tried, and what has come of it, in a few words."""
    done = sum(outcome.points for outcome in found)
    part = "" if done == points else f"{done} of "
    counted = ((points, "point"), (len(found), "outcome"))
    bad = sum(outcome.bad for outcome in found)
    words = [f"{count} {one}{'' if count == 1 else 's'}" for count, one in counted]
    return f"{part}{', '.join(words)}, {bad or 'none'} with something wrong"


ASSERTING = frozenset(("_pytest", "contextlib", "hamcrest", "numpy", "pandas", "pluggy", "pytest", "unittest", "vimc4"))
"""Packages that raise what a test asserts."""


def ending(error: BaseException | None, own: Callable[[str], bool]) -> Ending:
    """How a run has ended that has raised this. ``own`` says whether a file is the test's own: a failed assertion
    there is none of the driver."""
    if error is None:
        return "returned"
    if isinstance(error, GivenUp):
        return "hung"
    if isinstance(error, Unmet):
        return "unmet"
    if isinstance(error, Unfinished):
        return "asserted"
    pytest = sys.modules.get("pytest")
    failed = AssertionError if pytest is None else (AssertionError, pytest.fail.Exception)
    if not isinstance(error, failed):
        return "raised"
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__))
    raised_in = [
        frame.f_code.co_filename
        for frame in frames
        if frame.f_globals.get("__name__", "").partition(".")[0] not in ASSERTING
    ]
    return "asserted" if not raised_in or own(raised_in[-1]) else "raised"


def file_of(drive: Any) -> str | None:
    """The file in which a driver is written."""
    while isinstance(drive, functools.partial):
        drive = drive.func
    code = getattr(inspect.unwrap(drive), "__code__", None) or getattr(type(drive).__call__, "__code__", None)
    return None if code is None else code.co_filename


def is_done_when_it_returns(drive: Any) -> bool:
    """Whether calling it does what it does: neither a coroutine nor a generator is begun by that."""
    sorts = (inspect.iscoroutinefunction, inspect.isgeneratorfunction, inspect.isasyncgenfunction)
    called = (drive, getattr(drive, "__call__", None))
    return callable(drive) and not any(sort(one) for sort in sorts for one in called)


def chosen(
    harms: Harm | Sequence[Harm] | None, modes: Mode | Sequence[Mode] | None
) -> str:
    """Which points there are, as JSON."""
    choice: dict[str, Any] = {"live": True}
    for name, given, usual, more in (("harms", harms, HARMS, ASKED_FOR), ("modes", modes, MODES, ())):
        those = list(usual if given is None else [given] if isinstance(given, str) else given)
        for one in those:
            if one not in (*usual, *more):
                known = ", ".join((*usual, *more))
                raise ValueError(f"`{one}` is none of the {name}; they are {known}")
        if not those:
            raise ValueError(f"there are no {name} to try; leave {name} out for all of them")
        choice[name] = those
    return json.dumps(choice)


def begun(
    model: str | os.PathLike[str], machine: str | os.PathLike[str], given: str, choice: str
) -> _vimc4.SweepSession:
    """The points of a driver that has given this."""
    session = _vimc4.SweepSession(model, machine, given, choice)
    if session.points == 0:
        raise Error(
            "there is no point at which this could go wrong; the driver has to send something to its "
            "controller, and to move it if only moves are to go wrong"
        )
    return session


def begun_twice(
    model: str | os.PathLike[str], machine: str | os.PathLike[str], clean: list[str], choice: str
) -> _vimc4.SweepSession:
    """The points of a driver that has given this and this in two runs without a fault: the same."""
    session = begun(model, machine, clean[0], choice)
    again = _vimc4.SweepSession(model, machine, clean[1], choice)
    if difference := session.difference(again):
        raise Error(
            f"it does something else each time it runs: {difference}; points have no meaning then: make what it "
            "sends depend on nothing but what it hears"
        )
    return session


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


def _try(task: _Task, points: Iterable[int]) -> list[str]:
    """Tries some points, in whatever process this is."""
    session = begun(task.model, task.machine, task.given, task.choice)
    judged: list[str] = []
    limit = Limit(task.limit, task.grows)
    with swept_clock():
        for point in points:
            ran = limit.tries(lambda seconds: _run(task, session, point, seconds), lambda ran: ran.is_slow)
            judged.append(session.judge(point, ran.given, ran.ending))
    return judged


def _run(task: _Task, session: _vimc4.SweepSession | None, point: int, limit: float) -> _Ran:
    """Runs a driver once."""
    with _Tried(task.model, task.machine, "manual", coverage=False) as emulator:
        if session is not None:
            session.begin(emulator._core, point)
        ended: list[BaseException | None] = []

        def run() -> None:
            drives(emulator)
            try:
                task.drive(emulator)
                emulator.check()
                ended.append(None)
            except BaseException as error:
                ended.append(error)
            finally:
                drives(None)

        driver = threading.Thread(target=run, name="vimc4 driver", daemon=True)
        driver.start()
        driver.join(limit)
        hung = driver.is_alive()
        given = emulator._core.given().wait()
        # Whatever else it has expected, it has ended.
        Marks(()).outcome(emulator)
        if hung:
            _end(driver)
    if hung or not ended:
        return _Ran("hung", given, is_slow=hung)
    own = file_of(task.drive)
    return _Ran(ending(ended[0], lambda file: file == own), given, ended[0])


def _end(driver: threading.Thread) -> None:
    """Ends a thread that goes round and round: it hears of it as soon as it is in Python. One that waits
    elsewhere is left to its fate."""
    if driver.ident is not None:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(driver.ident), ctypes.py_object(GivenUp)
        )
    driver.join(0.5)
