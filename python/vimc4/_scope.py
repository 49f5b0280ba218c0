"""What is expected and what goes wrong ends with the test that has said it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, TypeVar

from ._errors import ControlError, Ended, Unfinished, Unmet

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from types import TracebackType

    from . import _vimc4
    from ._emulator import Emulator
    from ._types import Effect, FaultView, RuleView


_S = TypeVar("_S", bound="Scoped")


class Said:
    """A sentence that was begun. It ends in one of these ways."""

    def __init__(self, emulator: Emulator, place: str) -> None:
        self._emulator = emulator
        self.place = place
        emulator._said.append(self)

    def watch(self, expected: _vimc4.Expectation) -> Watched:
        self.over()
        return Watched(self._emulator, expected, self.place)

    def so_far(self, expected: _vimc4.Expectation) -> None:
        self.over()
        self._emulator._core.so_far(expected).wait()

    def over(self) -> None:
        if self in self._emulator._said:
            self._emulator._said.remove(self)


class Watched:
    """An expectation that is watched while things happen, from ``watch()`` on.

    When it cannot be met any more, `Unmet` is raised in the thread that has begun to watch: there, what
    waits for the emulator or reads from its line ends at once, or the next call that does. If nobody
    calls `check`, the emulator does at its end, and the plugin of pytest at the end of the test. As a
    context manager it is checked at the end of its ``with``.
    """

    def __init__(self, emulator: Emulator, expected: _vimc4.Expectation, place: str) -> None:
        self._emulator = emulator
        self._place = place
        self._number = emulator._core.watch_for(expected)
        self._outcome: Unmet | None = None
        emulator._watched.append(self)

    def check(self) -> None:
        """Raises `Unmet` if it is not met by all that has happened so far. It is not expected any more
        then. What was written to the line before has arrived."""
        unmet = self._end()
        if unmet is not None:
            raise unmet

    def give_up(self) -> None:
        """It is not expected any more, met or not."""
        self._end()
        self._outcome = None

    @property
    def failure(self) -> Unmet | None:
        """Why it cannot be met any more, if that is clear already; None otherwise."""
        if self not in self._emulator._watched:
            return self._outcome
        return self._emulator._core.failure(self._number)

    def wait_until_met(self, timeout: float | None = 10.0) -> None:
        """Waits until it is met, or raises `Unmet` when it cannot be any more, or `Late`. It goes on
        being expected: something may still come too often. Time does not pass by that where it does not
        by itself."""
        self._emulator._core.met(self._number).wait(timeout)
        failure = self.failure
        if failure is not None:
            raise failure

    def met(self) -> _vimc4.Pending[None]:
        """The same, to be awaited."""
        return self._emulator._core.met(self._number)

    def or_stop(self) -> Watched:
        """Ends the emulator as soon as it cannot be met any more: a driver in another thread or process
        that waits for an answer learns at once that nothing will come, instead of after its time-out."""
        self._emulator._core.or_stop(self._number)
        return self

    def _end(self) -> Unmet | None:
        if self in self._emulator._watched:
            self._emulator._watched.remove(self)
            self._outcome = self._emulator._core.unwatch(self._number)
            if self._outcome is not None:
                self._outcome.place = self._place
        return self._outcome

    def __enter__(self) -> Watched:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.check()
        else:
            tell(error, [unmet] if (unmet := self._end()) is not None else [])

    def __bool__(self) -> bool:
        raise TypeError(
            "an expectation is neither true nor false: check() raises why it is not met, and failure "
            "is that or None"
        )


class Scoped:
    """What goes wrong or happens until `end`, the end of its ``with``, of its test or of its emulator."""

    number: int
    """Its number, by which everybody else can end it."""

    def __init__(self, emulator: Emulator, number: int) -> None:
        self._emulator = emulator
        self.number = number
        emulator._scoped.append(self)

    @property
    def _lives(self) -> bool:
        return self in self._emulator._scoped

    def end(self) -> None:
        """It ends. Once is enough."""
        if not self._lives:
            return
        self._emulator._scoped.remove(self)
        try:
            # Both take effect, even if something that is not met is raised while they are waited for.
            stands, ended = self._ask(), self._stop()
            self._keep(stands.wait())
            ended.wait()
        except Ended:
            # What has ended has neither faults nor scenarios.
            pass

    def _look(self) -> None:
        if self._lives:
            self._keep(self._ask().wait())

    def _ask(self) -> _vimc4.Pending[list[Any]]:
        """How all of its kind stand."""
        raise NotImplementedError

    def _keep(self, views: list[Any]) -> None:
        """Remembers what of that is its own."""
        raise NotImplementedError

    def _stop(self) -> _vimc4.Pending[Effect]:
        raise NotImplementedError

    def __enter__(self: _S) -> _S:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()


class Fault(Scoped):
    """Something that goes wrong, from `Emulator.fault` until `end`, the end of its ``with``, of its test
    or of its emulator."""

    def __init__(self, emulator: Emulator, number: int, words: str) -> None:
        super().__init__(emulator, number)
        self._words = words
        self._last: FaultView | None = None

    def _ask(self) -> _vimc4.Pending[list[Any]]:
        return self._emulator._core.faults()

    def _keep(self, views: list[FaultView]) -> None:
        self._last = next((view for view in views if view.number == self.number), None)

    def _stop(self) -> _vimc4.Pending[Effect]:
        return self._emulator._core.end_fault(self.number)

    def view(self) -> FaultView | None:
        """How far it has come and how often it has struck; None if somebody else has ended it. One that
        has ended by itself or here is as it was at its end."""
        self._look()
        return self._last

    @property
    def struck(self) -> int:
        """How often it has struck."""
        view = self.view()
        return 0 if view is None else view.struck

    @property
    def is_over(self) -> bool:
        """Whether it will not strike any more: it has struck as often as it was to, its time is over, or
        it was ended."""
        view = self.view()
        return view is None or not self._lives or view.stage == "over"

    def __repr__(self) -> str:
        return f"<vimc4.Fault {self.number}: {self._words}>"


class Scenario(Scoped):
    """Rules by which things happen, from `Emulator.scenario` until `end`, the end of its ``with``, of its
    test or of its emulator. What they hold is set back then."""

    def __init__(self, emulator: Emulator, number: int) -> None:
        super().__init__(emulator, number)
        self._last: list[RuleView] = []

    def _ask(self) -> _vimc4.Pending[list[Any]]:
        return self._emulator._core.rules()

    def _keep(self, views: list[RuleView]) -> None:
        self._last = [view for view in views if view.scenario == self.number]

    def _stop(self) -> _vimc4.Pending[Effect]:
        return self._emulator._core.end_scenario(self.number)

    def rules(self) -> list[RuleView]:
        """Its rules, how far each has come and how often it has acted; none if somebody else has ended
        it. One that has ended here is as it was at its end."""
        self._look()
        return self._last

    @property
    def acted(self) -> int:
        """How often its rules have acted, all together."""
        return sum(view.acted for view in self.rules())

    def __repr__(self) -> str:
        return f"<vimc4.Scenario {self.number}>"


class Marks:
    """What is expected of emulators and what goes wrong by now, for what comes after."""

    def __init__(self, emulators: Iterable[Emulator]) -> None:
        self._known: set[object] = set()
        for emulator in emulators:
            self._known |= {*emulator._watched, *emulator._said, *emulator._scoped}

    def outcome(self, emulator: Emulator) -> list[Unmet | Unfinished]:
        """Ends what has been expected of an emulator since, and what has failed since, and says what of
        it is not met."""
        if any(watched in self._known for watched in emulator._watched):
            try:
                # What was written to the line before has arrived then.
                emulator._core.now().wait()
            except (Unmet, ControlError):
                pass
        unmet: list[Unmet | Unfinished] = []
        for watched in list(emulator._watched):
            if watched not in self._known or watched.failure is not None:
                failure = watched._end()
                if failure is not None:
                    unmet.append(failure)
        for said in list(emulator._said):
            if said not in self._known:
                said.over()
                unmet.append(Unfinished(said.place))
        return unmet

    def end_scoped(self, emulator: Emulator) -> None:
        """Ends the faults and scenarios that were begun since, the last of them first."""
        for scoped in [one for one in reversed(emulator._scoped) if one not in self._known]:
            scoped.end()


def raise_first(unmet: list[Unmet | Unfinished]) -> None:
    """Raises what is not met, if something is not."""
    if unmet:
        first, *others = unmet
        tell(first, others)
        raise first


def tell(error: BaseException, unmet: Sequence[Unmet | Unfinished]) -> None:
    """An error takes with it what was expected and is not met, for that may be what it is about."""
    for other in unmet:
        if other is error or str(other) == str(error):
            continue
        if sys.version_info >= (3, 11):
            error.add_note(str(other))
        else:
            print(other, file=sys.stderr)
