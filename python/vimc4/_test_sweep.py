"""A test that is run once more for each fault that can strike what it does."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Iterator

import pytest
from _pytest.runner import runtestprotocol

from . import _vimc4
from ._clock import GivenUp, Limit, TooSlow, drives, swept_clock
from ._errors import Error
from ._sweep import (
    AWAITS,
    PATIENCE,
    Swept,
    Unsweepable,
    _Tried,
    begun_twice,
    chosen,
    ending,
    is_done_when_it_returns,
    longest,
    outcomes,
    patience,
    summary,
    unended,
)

if TYPE_CHECKING:
    from ._emulator import Emulator
    from ._types import Ending

SWEPT = "vimc4 sweep"
"""The property of a report that says in words what has come of a sweep."""


class Trial:
    """One run of a test that is swept."""

    def __init__(
        self,
        session: _vimc4.SweepSession | None = None,
        point: int = 0,
        failure: Error | None = None,
        refusal: Error | None = None,
    ) -> None:
        self._session, self._point = session, point
        self.failure = failure
        """What is raised at the end of the test, if nothing else is."""
        self.refusal = refusal
        """Why the test cannot be swept, which is raised in its place."""
        self._emulator: Emulator | None = None
        self._error: BaseException | None = None
        self._hung = False
        self.is_slow = False
        """Whether it has exceeded its limit."""
        self.given = "[]"
        self.site: tuple[Any, Any] = ("imc4", "bench")
        self.recorded = False
        self.recording: str | None = None

    def start(self, options: dict[str, Any], request: pytest.FixtureRequest) -> Emulator:
        """Starts its controller. How time passes is up to the sweep."""
        if self._emulator is not None:
            self.refusal = Error("a test with several controllers cannot be swept; leave it out")
            raise self.refusal
        ours = ("model", "machine", "time", "coverage", "recording", "record_failure")
        others = {name: value for name, value in options.items() if name not in ours}
        if self.recorded:
            folder = request.getfixturevalue("tmp_path_factory").mktemp("vimc4-sweep")
            self.recording = str(folder / f"case-{self._point}.jsonl")
        self.site = (options.get("model", "imc4"), options.get("machine", "bench"))
        try:
            self._emulator = _Tried(
                *self.site, "manual", coverage=False, recording=self.recording, **others
            )
        except Unsweepable as error:
            self.refusal = error
            raise
        if self._session is not None:
            self._session.begin(self._emulator._core, self._point)
        drives(self._emulator)
        return self._emulator

    def end(self) -> None:
        """Its controller is about to end."""
        if self._emulator is not None:
            self.given = self._emulator._core.given().wait()

    def take(self, report: pytest.TestReport, call: pytest.CallInfo[None]) -> None:
        """Takes note of a phase of the test. Whether it is expected to fail is for its own report."""
        error = None if call.excinfo is None else call.excinfo.value
        if isinstance(error, Unsweepable):
            self.refusal = error
        self._hung |= isinstance(error, GivenUp)
        self.is_slow |= isinstance(error, TooSlow)
        if self._error is None:
            self._error = error

    def give_up(self) -> None:
        """It has not ended."""
        self._hung = self.is_slow = True

    def ending(self, item: pytest.Function) -> Ending:
        """How the test has ended. Its module and the files ``conftest.py`` are its own."""
        own = str(item.path)
        return "hung" if self._hung else ending(self._error, lambda file: file == own or is_conftest(file))


def is_conftest(file: str) -> bool:
    return os.path.basename(file) == "conftest.py"


TRIAL: pytest.StashKey[Trial | None] = pytest.StashKey()


def swept(
    item: pytest.Function, nextitem: pytest.Item | None, mark: pytest.Mark | None
) -> list[pytest.TestReport]:
    """Sweeps a test. Its reports are those of a run without a fault, which fails in the end if something is wrong
    with a fault. A test that cannot be swept is an error, whatever it is expected to do."""
    with swept_clock():
        return _swept(item, nextitem, mark)


def _swept(
    item: pytest.Function, nextitem: pytest.Item | None, mark: pytest.Mark | None
) -> list[pytest.TestReport]:
    began = time.perf_counter()
    told: str = ""
    failure: Error | None = None
    refusal: Error | None = None
    try:
        told, failure = _sweep(item, **_options(mark))
    except (Error, TypeError, ValueError) as error:
        refusal = Error(f"it cannot be swept: {error}")
    reports = _run(item, nextitem, Trial(failure=failure, refusal=refusal), PATIENCE)
    for report in reports:
        if report.when == "call":
            report.duration = time.perf_counter() - began
            if told:
                report.user_properties.append((SWEPT, told))
    return reports


def is_swept(item: pytest.Item) -> bool:
    """Whether a test has what it takes."""
    return isinstance(item, pytest.Function) and "vimc4_start" in item.fixturenames


def _options(mark: pytest.Mark | None) -> dict[str, Any]:
    """What the marker says."""
    if mark is None:
        return {}
    known = ("harms", "modes", "limit")
    if mark.args:
        raise TypeError(f'the marker {mark.name} has named options only, as in {mark.name}(harms=["stop"])')
    for name in mark.kwargs:
        if name not in known:
            raise TypeError(f"the marker {mark.name} has no option `{name}`; it has {', '.join(known)}")
    return dict(mark.kwargs)


def _sweep(
    item: pytest.Function, harms: Any = None, modes: Any = None, limit: float | None = None
) -> tuple[str, Error | None]:
    """What has come of a sweep in a few words, and what is wrong."""
    choice = chosen(harms, modes)
    if not is_swept(item):
        raise TypeError(
            "the test has no controller among its arguments; name the fixture `vimc4` or `vimc4_start` there, because one "
            "that request.getfixturevalue starts comes too late"
        )
    if not is_done_when_it_returns(item.function):
        raise Unsweepable(AWAITS)
    began, clean = time.monotonic(), []
    for _ in range(2):
        trial = Trial()
        # The collector of a test keeps all that is not of this test alone.
        _run(item, item.parent, trial, patience(limit))
        if trial.refusal is not None:
            raise trial.refusal
        if trial.ending(item) == "hung":
            raise Error(f"it {unended(patience(limit), limit)}")
        if trial.ending(item) != "returned":
            # Its own report says so, unless it does not fail again.
            return "", Error("it cannot be swept: without a fault it fails one time, and another time it does not")
        clean.append(trial.given)
    usual = longest((time.monotonic() - began) / 2) if limit is None else patience(limit)
    limits = Limit(usual, limit is None)
    session = begun_twice(*trial.site, clean, choice)
    results = _vimc4.SweepResults(session, item.nodeid)
    for point in range(session.points):
        trial = limits.tries(lambda seconds: _tried(item, Trial(session, point), seconds), lambda it: it.is_slow)
        results.add(session.judge(point, trial.given, trial.ending(item)))
    found = outcomes(results)
    bad = [outcome for outcome in found if outcome.bad]
    told = summary(session.points, found)
    cases = [f"{outcome}\n{_recorded(item, session, outcome.point, limits.now())}" for outcome in bad]
    # How it has ended stands last, where a long report is read first.
    return told, Swept("\n\n".join([*cases, told])) if bad else None


def _recorded(
    item: pytest.Function, session: _vimc4.SweepSession, point: int, limit: float
) -> str:
    """Runs the test once more for a recording, and says how it is looked at."""
    trial = Trial(session, point)
    trial.recorded = True
    _run(item, item.parent, trial, limit)
    return f"  vimc4 replay {trial.recording}\n  vimc4 console {trial.recording}"


def _tried(item: pytest.Function, trial: Trial, limit: float) -> Trial:
    _run(item, item.parent, trial, limit)
    return trial


def _run(
    item: pytest.Function, nextitem: Any, trial: Trial, limit: float
) -> list[pytest.TestReport]:
    item.stash[TRIAL] = trial
    # Its fixtures begin anew, and what it has logged and printed in another run is not said again.
    item._initrequest()
    item._report_sections.clear()
    try:
        with _given_up_after(limit):
            return runtestprotocol(item, log=False, nextitem=nextitem)
    except GivenUp:
        # Between two phases of the test.
        trial.give_up()
        return []
    finally:
        item.stash[TRIAL] = None
        drives(None)


@contextmanager
def _given_up_after(limit: float) -> Iterator[None]:
    """A test that takes longer is given up where it is."""
    has_alarm = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if not has_alarm:
        yield
        return

    def give_up(*_: object) -> None:
        raise TooSlow(f"it has not ended after {limit:.1f} s")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
