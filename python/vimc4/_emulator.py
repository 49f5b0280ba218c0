"""The emulator."""

from __future__ import annotations

import atexit
import itertools
import os
import sys
import warnings
import weakref
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator

from . import _vimc4
from ._errors import ELSEWHERE, Ended, RecordingWarning
from ._port import Port
from ._scope import Fault, Marks, Said, Scenario, Scoped, Watched, raise_first, tell

if TYPE_CHECKING:
    from datetime import timedelta
    from types import TracebackType

    from ._aio import Aio
    from ._journal import Journal
    from ._serial import Serial
    from ._types import (
        Breakpoint,
        Command,
        Effect,
        Event,
        FaultView,
        Pause,
        Report,
        RuleView,
        Signal,
        Step,
        View,
    )
    from ._vimc4 import Coverage, Expect, Harness, Machine, Model, Recording, Snapshot, Worker

running: weakref.WeakValueDictionary[str, Emulator] = weakref.WeakValueDictionary()
"""The emulators of this process, by their names."""

covered: Callable[[Coverage], object] | None = None
"""Gets what hosts have met from every emulator at its end, if somebody wants it."""

_numbers = itertools.count(1)


class Emulator:
    """A virtual controller that runs until it is closed.

    >>> import vimc4
    >>> with vimc4.Emulator("imc-s8", time="manual") as emulator:
    ...     port = emulator.connect()
    ...     port.write(b"@07\\r@0A5000,900,0,900,0,900,0,900\\r")
    ...     at = emulator.run_until("x = 2500")
    ...     emulator.position()
    34
    [2500, 0, 0, 0]

    The methods wait until the controller has done what they say, which takes microseconds unless
    time is to pass. What was written to the line before one of them is called has arrived when it
    takes effect. Other threads run meanwhile, and Ctrl-C ends any waiting. `aio` has the same methods
    to be awaited.

    Times are nanoseconds, whole numbers. Spans of time that are given have a unit: ``"250ms"``, or a
    ``timedelta``. Seconds are only those on the wall, which a ``timeout`` counts.
    """

    name: str
    """What it is called in reports and addresses."""

    _tried = False

    def __init__(
        self,
        model: str | os.PathLike[str] | Model = "imc4",
        machine: str | os.PathLike[str] | Machine = "bench",
        time: str = "real",
        *,
        pty: bool | str | os.PathLike[str] = False,
        replace_link: bool = False,
        fresh_clients: bool = False,
        tcp: str | None = None,
        rfc2217: str | None = None,
        tcp_clients: str = "refuse",
        serial: str | None = None,
        flash: str | os.PathLike[str] | None = None,
        line_pacing: bool = False,
        paused: bool = False,
        record: bool = True,
        coverage: bool | None = None,
        recording: str | os.PathLike[str] | None = None,
        record_failure: str | os.PathLike[str] | None = None,
        record_size: int | None = None,
        recorded_by: str = "Python",
        name: str | None = None,
        on: Worker | None = None,
        scenario: str | os.PathLike[str] | None = None,
    ) -> None:
        """Starts a controller.

        :param model: a built-in name (`vimc4.models()`), a profile file or a `vimc4.Model`
        :param machine: a built-in name (`vimc4.machines()`), a profile file or a `vimc4.Machine`
        :param time: how time passes: ``real``, ``instant``, ``manual``, or a factor such as ``8x``
        :param pty: a pseudo-terminal: True for one of any name, a path for a link that leads to it
        :param replace_link: whether the link may be taken from an emulator that still runs
        :param fresh_clients: whether a half line of a client that has left is forgotten
        :param tcp: an address to listen on; ``127.0.0.1:0`` picks a free port
        :param rfc2217: the same for clients that speak RFC 2217: a serial port over the network
        :param tcp_clients: what happens to a second client: ``refuse``, ``takeover``, ``observe``
        :param serial: a real serial port, such as ``/dev/ttyUSB0``
        :param flash: a file for the flash memory, created if it is not there
        :param line_pacing: whether a character takes its time on the line
        :param paused: whether its time is paused from the first moment
        :param record: whether commands, events and the conversation are remembered
        :param coverage: whether it counts what of its protocol the host meets; with pytest's option
            ``--vimc4-coverage`` it does unless this says otherwise
        :param recording: a file into which everything is recorded; it must not be there yet
        :param record_failure: the same, but it stays only if a ``with`` ends by an exception
        :param record_size: about how many bytes a file of the recording has at most
        :param recorded_by: who records, as the recording says it
        :param name: what it is called; without a name it has a number
        :param on: a thread that it shares with other emulators; it has one of its own otherwise
        :param scenario: what happens when, from its first moment: see `scenario`
        """
        if recording is not None and record_failure is not None:
            raise ValueError("a recording either stays or stays only after a failure: give one file")
        if name is None:
            name = next(number for number in map(str, _numbers) if number not in running)
        self.name = name
        self._watched: list[Watched] = []
        self._said: list[Said] = []
        self._scoped: list[Scoped] = []
        self._failed_only = record_failure is not None
        self._core: _vimc4.Core = _vimc4.Core(
            model=model,
            machine=machine,
            time=time,
            pty=pty,
            replace_link=replace_link,
            fresh_clients=fresh_clients,
            tcp=tcp,
            rfc2217=rfc2217,
            tcp_clients=tcp_clients,
            serial=serial,
            flash=flash,
            line_pacing=line_pacing,
            paused=paused,
            record=record,
            coverage=covered is not None if coverage is None else coverage,
            recording=recording if record_failure is None else record_failure,
            record_size=record_size,
            recorded_by=recorded_by,
            name=name,
            on=on,
            tried=self._tried,
        )
        running[name] = self
        if scenario is not None:
            try:
                self.scenario(scenario)
            except BaseException:
                self.close()
                raise

    @property
    def aio(self) -> Aio:
        """The same controls, to be awaited."""
        from ._aio import Aio

        return Aio(self)

    # --- its end ---

    def __enter__(self) -> Emulator:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            self.keep_recording()
            tell(error, Marks(()).outcome(self))
        self.close()

    def __del__(self) -> None:
        # Whatever of Python is still there: an emulator that could not start has no core.
        if "_core" in self.__dict__:
            self.close()

    def close(self) -> None:
        """Ends it, and waits for that: its ports and its link are free afterwards. Once is enough.
        Raises what was expected of it, is not met, and was not checked before."""
        core = self._core
        if core.closed:
            return
        unmet = Marks(()).outcome(self)
        if unmet:
            self.keep_recording()
        recording = core.recording
        core.close()
        if covered is not None and (coverage := core.coverage_so_far()) is not None:
            covered(coverage)
        if recording is not None and self._failed_only:
            recording.discard()
        for error in core.take_recording_errors():
            warnings.warn(error, RecordingWarning, stacklevel=2)
        raise_first(unmet)

    @property
    def closed(self) -> bool:
        """Whether it has been closed."""
        return self._core.closed

    def stop(self) -> None:
        """Tells it to end, without waiting for that."""
        self._core.stop()

    def ended(self, timeout: float | None = None) -> None:
        """Waits until it has ended, and raises the error if it has by itself."""
        self._core.ended().wait(timeout)

    def __repr__(self) -> str:
        core = self.__dict__.get("_core")
        if core is None:
            return "<vimc4.Emulator that has not started>"
        if isinstance(core, _Elsewhere):
            return f"<vimc4.Emulator {self.name}, in another process>"
        return f"<vimc4.Emulator {self.name}: {core.model}{', closed' if core.closed else ''}>"

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(
            "an emulator is neither copied nor pickled: snapshot() keeps its state, and harness() is a copy "
            "of its controller"
        )

    # --- where it is ---

    @property
    def model(self) -> str:
        """The name of its model."""
        return self._core.model

    @property
    def axis_names(self) -> list[str]:
        """What the controller calls its axes, in the order of `position`."""
        return self._core.axis_names

    @property
    def baud(self) -> int:
        """Bits per second of its serial line when it is switched on."""
        return self._core.baud

    @property
    def port(self) -> str | None:
        """The path of the serial port that a program opens: the link, or the pseudo-terminal itself.
        None if there is no pseudo-terminal."""
        path = self._core.port
        return None if path is None else os.fspath(path)

    @property
    def tcp_addr(self) -> tuple[str, int] | None:
        """Where it listens, with the port that was picked."""
        return self._core.tcp

    @property
    def serial_device(self) -> str | None:
        """The real serial port that it has open."""
        return self._core.serial

    @property
    def url(self) -> str:
        """The address of this very emulator for ``serial.serial_for_url``, within this process."""
        from urllib.parse import quote

        return f"vimc4://?emulator={quote(self.name, safe='')}"

    @property
    def socket_url(self) -> str | None:
        """The address for ``serial.serial_for_url`` in any process; None if it does not listen."""
        return None if self.tcp_addr is None else _address("socket", self.tcp_addr)

    @property
    def rfc2217_url(self) -> str | None:
        """The address of the serial port over the network that it serves by RFC 2217; None if it does
        not."""
        where = self._core.rfc2217
        return None if where is None else _address("rfc2217", where)

    @property
    def recording(self) -> Recording | None:
        """The recording of it, if it is recorded into a file."""
        return self._core.recording

    def keep_recording(self) -> None:
        """The recording stays, although it was begun as one that stays only after a failure."""
        self._failed_only = False

    def unlink(self) -> None:
        """Removes the link to its pseudo-terminal. Clients that have it open stay."""
        self._core.unlink()

    def connect(
        self, timeout: float | None = 10.0, write_timeout: float | None = 10.0
    ) -> Port:
        """Opens the line from within the process. All that are open at the same time are one wire:
        each sees everything the controller sends. It needs nothing but Python."""
        return Port(self._connect(), timeout, write_timeout)

    def _connect(self) -> _vimc4.Port:
        return self._core.connect().wait()

    def serial(
        self, baudrate: int | None = None, *, timeout: float | None = 10.0, **settings: Any
    ) -> Serial:
        """Opens the line from within the process as a port of pyserial, with all of its methods and
        settings. If nothing else is said, it has the controller's baud rate, and reading waits ten
        seconds at most: a test that waits in vain fails, and does not hang."""
        from ._serial import Serial

        baudrate = self.baud if baudrate is None else baudrate
        return Serial(self.url, baudrate, emulator=self, timeout=timeout, **settings)

    # --- time ---

    def now(self) -> int:
        """The controller's time, in nanoseconds."""
        return self._core.now().wait()

    def advance(self, span: str | timedelta) -> int:
        """Moves time forward, as in ``advance("250ms")``, with the clocks that do not run by
        themselves. Says what time it is then."""
        return self._core.advance(span).wait()

    def run_until(self, condition: str, timeout: float | None = None) -> int:
        """Lets time pass up to the first instant at which the condition holds, and says when that
        was: ``x = 2500``, ``z < -5000``, ``port 2 bit 0 on``, ``limit x+``, ``command @A``, ``answer
        error 2``, ``line 12``, ``at 2s``; several are joined by ``and``, ``or``. With a clock that
        runs by itself it waits for it, no longer than the timeout.

        It raises `Never` if that does not come about unless something else happens first. Time has
        not moved then.
        """
        return self._core.run_until(condition).wait(timeout)

    def run_until_idle(self, timeout: float | None = None) -> int:
        """Lets time pass until the controller does nothing any more, and says when that was."""
        return self.run_until("idle", timeout)

    def cancel_all(self) -> None:
        """Gives up every way through time that somebody else is waiting for."""
        self._core.cancel_all()

    # --- what it sees ---

    def position(self) -> list[int]:
        """The step counters of the axes that the controller has, X first."""
        return self._core.position().wait()

    def view(self) -> View:
        """A picture of the controller: positions, speeds, program, ports and what it will do."""
        return self._core.view().wait()

    def commands(self) -> list[Command]:
        """What the host sent, decoded, oldest first."""
        return self._core.commands().wait()

    def next_command(self, mnemonic: str, timeout: float | None = 10.0) -> Command:
        """Waits until the host sends a command of this mnemonic, such as ``@A``, and says which that
        was. It counts from the command that was waited for last, so that none is missed."""
        return self._core.next_command(mnemonic).wait(timeout)

    def events(self) -> list[Event]:
        """What happened, oldest first."""
        return self._core.events().wait()

    def conversation(self) -> str:
        """The conversation so far as people read it, the last 10,000 lines of it. It can be asked for
        when the emulator is closed, too."""
        if self.closed:
            return self._core.conversation_so_far()
        return self._core.conversation().wait()

    def forget(self) -> None:
        """Forgets the commands, the events and the conversation so far."""
        self._core.forget().wait()

    def reports(self, *wants: str, room: int = 10_000) -> Reports:
        """What happens from now on, to be taken whenever there is time for it; see `Reports`."""
        return Reports(self, wants=wants, room=room)

    # --- what is expected ---

    def expect(self) -> Expect:
        """Begins a sentence about what has to happen: from now on, if it ends with ``watch()``, or so
        far, if it ends with ``so_far()``.

        >>> import vimc4
        >>> with vimc4.Emulator("imc4", "mill", "manual") as emulator:
        ...     moved = emulator.expect().command("@A").answered("0").once().watch()
        ...     inside = emulator.expect().never("x > 20mm").watch()
        ...     written = emulator.connect().write(b"@07\\r@0A800,900,0,900,0,900,0,900\\r")
        ...     at = emulator.run_until_idle()
        ...     moved.check()
        ...     inside.check()
        ...     emulator.expect().command("@P").never().so_far()
        """
        caller = sys._getframe(1)
        said = Said(self, f"{caller.f_code.co_filename}:{caller.f_lineno}")
        try:
            return self._core.expect(said)
        except BaseException:
            said.over()
            raise

    def check(self) -> None:
        """Checks everything that is expected of it, which is not expected any more then. Its end does
        that, too, and at the end of a test the plugin of pytest."""
        raise_first(Marks(()).outcome(self))

    def coverage(self) -> Coverage:
        """How much of what it can do the host has met so far: commands, their answers, the states that
        they found and what stopped them. It has to be begun with ``coverage=True``."""
        return self._core.coverage().wait()

    def journal(self) -> Journal:
        """Everything that happened, oldest first: commands, answers, motions, ports, what people did."""
        return self._core.journal().wait()

    # --- what goes wrong ---

    def fault(self, words: str) -> Fault:
        """Something goes wrong from now on, on the line or at the machine, until it ends: ``with
        emulator.fault("drop to-host once"):``. The words are those of the orders.

        >>> import vimc4
        >>> with vimc4.Emulator(time="instant") as emulator:
        ...     port = emulator.connect()
        ...     with emulator.fault("garble into ? to-host after command @0P") as fault:
        ...         written = port.write(b"@07\\r@0P\\r")
        ...         port.read(2), fault.struck
        ...     emulator.faults()
        (b'0?', 1)
        []
        """
        return Fault(self, self._core.fault(words).wait(), words)

    def faults(self) -> list[FaultView]:
        """The present faults, and how often each has struck."""
        return self._core.faults().wait()

    def end_faults(self) -> None:
        """Ends all faults, whoever has begun them."""
        for scoped in list(self._scoped):
            if isinstance(scoped, Fault):
                scoped.end()
        self._core.end_faults().wait()

    # --- what happens when ---

    def scenario(self, scenario: str | os.PathLike[str]) -> Scenario:
        """Things happen from now on as rules say, until it ends: ``with emulator.scenario("when x > 1000:
        press stop"):``. The rules are those of the orders, one a line, or the name of a file of them,
        which ends in ``.toml``.

        >>> import vimc4
        >>> with vimc4.Emulator(time="instant") as emulator:
        ...     port = emulator.connect()
        ...     with emulator.scenario("rule once when x > 100: press stop") as stops:
        ...         written = port.write(b"@01\\r@0A1000,900\\r")
        ...         port.read(2), stops.acted
        ...     emulator.rules()
        (b'0F', 1)
        []
        """
        # No rule ends like that.
        if isinstance(scenario, str) and not scenario.endswith(".toml"):
            begun = self._core.scenario(scenario)
        else:
            begun = self._core.scenario_file(scenario)
        return Scenario(self, begun.wait())

    def rules(self) -> list[RuleView]:
        """The rules of the present scenarios, and how often each has acted."""
        return self._core.rules().wait()

    def end_scenarios(self) -> None:
        """Ends all scenarios, whoever has begun them."""
        for scoped in self._scoped[::-1]:
            if isinstance(scoped, Scenario):
                scoped.end()
        self._core.end_scenarios().wait()

    def reset(self) -> None:
        """Ends all scenarios and all faults, whoever has begun them."""
        for scoped in self._scoped[::-1]:
            scoped.end()
        self._core.reset().wait()

    # --- what happens to it ---

    def signals(self) -> list[Signal]:
        """The things of the outside world that can be set, with their names."""
        return self._core.signals().wait()

    def complete(self, begun: str) -> list[tuple[str, str]]:
        """All ways to go on with an order that has been begun, each with what it is."""
        return self._core.complete(begun)

    def order(self, line: str) -> str:
        """Carries out an order as people type it where ``vimc4 serve`` runs, as in ``press stop``,
        and says what comes of it. ``help`` lists them."""
        return self._core.order(line).wait()

    def set_signal(self, name: str, value: int) -> Effect:
        """Sets a signal to any value it takes: 1 and 0, or the number of a switch's position."""
        return self._core.set_signal(name, value).wait()

    def press(self, button: str) -> Effect:
        """Presses a button, ``start``, ``stop``, ``on`` or ``estop``, and releases it at the same
        instant; the emergency stop stays pressed until it is released."""
        return self._core.press(button).wait()

    def hold(self, button: str) -> Effect:
        """Presses a button and keeps it pressed."""
        return self._core.hold(button).wait()

    def release(self, button: str) -> Effect:
        """Releases a button."""
        return self._core.release(button).wait()

    def turn(self, switch: str, position: str) -> Effect:
        """Puts a switch into a position, as in ``turn("cover", "open")``."""
        return self._core.turn(switch, position).wait()

    def input(self, port: int, bit: int, level: bool) -> Effect:
        """Sets a bit of an input port, as the controller reads it."""
        return self._core.input(port, bit, level).wait()

    def erase(self) -> Effect:
        """Erases the stored program as a person does at the panel. The controller has then been
        reset, and its power stages are off until ``on`` is pressed or it is switched off and on."""
        return self._core.erase().wait()

    def power(self, on: bool) -> Effect:
        """Takes the power away or gives it back."""
        return self._core.power(on).wait()

    def snapshot(self) -> Snapshot:
        """The present state. `restore` goes back to it, as often as wanted."""
        return self._core.snapshot().wait()

    def restore(self, snapshot: Snapshot) -> None:
        """Goes back to a state taken earlier, of this or another emulator of the same model. Its
        time goes back with it; clients stay connected."""
        self._core.restore(snapshot).wait()

    def harness(self) -> Harness:
        """A copy of the controller as it is now, in virtual time: to be looked at, or driven on."""
        return self._core.harness().wait()

    def put(self, harness: Harness) -> None:
        """Goes on from where a copy of the controller is, at an earlier or a later time."""
        self._core.put(harness).wait()

    # --- time stands still ---

    def pause(self) -> int:
        """Pauses time, whatever the clock, and says when that was. Clients stay connected, and
        notice nothing but that it takes its time."""
        return self._core.pause().wait()

    def resume(self) -> int:
        """Time goes on from where it is. What has passed meanwhile is not made up for."""
        return self._core.resume().wait()

    def paused(self) -> Pause | None:
        """Since when time is paused, and why; None if it goes on."""
        return self._core.paused().wait()

    def until_paused(self, timeout: float | None = None) -> Pause:
        """Waits until time is paused by whomever or whatever, and says why."""
        return self._core.until_paused().wait(timeout)

    def step(self) -> Step:
        """Does one thing while time is paused, and says what that was."""
        return self._core.step().wait()

    def hear(self, size: int) -> int:
        """Takes in no more than so many bytes that wait on the line, although time is paused, and
        says how many that were."""
        return self._core.hear(size).wait()

    def break_when(self, condition: str) -> int:
        """Pauses time whenever a condition becomes true, exactly then: before anything else happens,
        even at the same instant. Returns the breakpoint's number."""
        return self._core.break_when(condition).wait()

    def remove_breakpoint(self, breakpoint: int) -> bool:
        """Takes a breakpoint away, and says whether it was there."""
        return self._core.remove_breakpoint(breakpoint).wait()

    def breakpoints(self) -> list[Breakpoint]:
        """The breakpoints, and how often each was met."""
        return self._core.breakpoints().wait()


def _address(scheme: str, where: tuple[str, int]) -> str:
    host, port = where
    return f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"


class Reports:
    """Everything that happens to one or several emulators from now on, for those who take their
    time: ``for report in vimc4.Reports(emulator, wants=["warning"])``.

    Wanted may be ``inputs``, what goes in; ``sent``, the bytes that leave; and the kinds of events
    ``command``, ``answer``, ``motion``, ``switch``, ``signal``, ``port``, ``flash``, ``line`` and
    ``warning``. It is everything if nothing is said. News, of who comes and goes, are always told.

    An emulator never waits for its watchers: so many reports at most are kept, and what finds no room
    is counted; a ``missed`` report stands in its place. The reports end with the emulators.
    """

    def __init__(self, *emulators: Emulator, wants: Iterable[str] = (), room: int = 10_000) -> None:
        wants = list(wants) or [
            "inputs", "sent", "command", "answer", "motion", "switch", "signal", "port", "flash",
            "line", "warning",
        ]  # fmt: skip
        self._reports = _vimc4.Reports(wants, room)
        for emulator in emulators:
            emulator._core.watch(self._reports).wait()
        self._reports.complete()

    def take(self) -> Report | None:
        """The next report that is there; None if there is none."""
        return self._reports.take()

    def wait(self, timeout: float | None = None) -> Report | None:
        """Waits for the next report; None when nothing will come any more."""
        return self._reports.wait(timeout)

    def next_report(self) -> _vimc4.Pending[Report | None]:
        """The next report, to be awaited; None when nothing will come any more."""
        return self._reports.next_report()

    def __iter__(self) -> Iterator[Report]:
        while (report := self.wait()) is not None:
            yield report


class _Elsewhere:
    """What a copy of the process has of an emulator: nothing."""

    closed = True

    def __getattr__(self, name: str) -> Any:
        raise Ended(ELSEWHERE)


def _close_all() -> None:
    _vimc4.leave()
    failed = False
    for emulator in list(running.values()):
        try:
            emulator.close()
        except Exception:
            # What nobody has checked is told, and the others are closed all the same.
            sys.excepthook(*sys.exc_info())
            failed = True
    if failed:
        print(
            "vimc4: this was found after the end of the program, too late for its exit code; check() or close() "
            "the emulator, or use `with`",
            file=sys.stderr,
        )


def _leave_all() -> None:
    for emulator in list(running.values()):
        emulator._core = _Elsewhere()  # type: ignore[assignment]
    running.clear()


atexit.register(_close_all)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_all)
