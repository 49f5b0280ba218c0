"""Awaiting what others wait for."""

from __future__ import annotations

import asyncio
import itertools
import sys
import threading
import weakref
from typing import TYPE_CHECKING, Any, AsyncIterator, Callable

from . import _vimc4

if TYPE_CHECKING:
    from datetime import timedelta

    from ._emulator import Emulator
    from ._journal import Journal
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
    from ._vimc4 import Coverage, Harness, Journey, Pending, Port, Snapshot


class _Waiting:
    """Who waits in one loop. The emulators ring; none of their threads enters Python."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = weakref.ref(loop)
        self.bell = _vimc4.Bell()
        self.keys = itertools.count()
        self.futures: dict[int, asyncio.Future[None]] = {}
        if sys.platform == "win32":
            # The loop that Windows has watches no sockets: a thread waits, and tells it.
            weakref.finalize(self, self.bell.close)
            told = (self.bell, self.loop, weakref.WeakMethod(self.rung))
            threading.Thread(target=_tell, args=told, name="vimc4", daemon=True).start()

    def begin(self, loop: asyncio.AbstractEventLoop) -> None:
        if sys.platform != "win32":
            loop.add_reader(self.bell.fileno(), self.rung)

    def end(self, loop: asyncio.AbstractEventLoop) -> None:
        if sys.platform != "win32":
            loop.remove_reader(self.bell.fileno())

    def rung(self) -> None:
        for key in self.bell.take():
            future = self.futures.get(key)
            if future is not None and not future.done():
                future.set_result(None)

    async def wait(self, pending: Pending[Any]) -> None:
        loop = asyncio.get_running_loop()
        key = next(self.keys)
        future = self.futures[key] = loop.create_future()
        if len(self.futures) == 1:
            self.begin(loop)
        try:
            while not pending.ready_or_ring(self.bell, key):
                await future
                future = self.futures[key] = loop.create_future()
        except BaseException:
            pending.abandon()
            raise
        finally:
            del self.futures[key]
            if not self.futures:
                self.end(loop)


if sys.platform == "win32":

    def _tell(
        bell: _vimc4.Bell,
        loop: weakref.ref[asyncio.AbstractEventLoop],
        rung: weakref.WeakMethod[Callable[[], None]],
    ) -> None:
        """Tells a loop that the bell has rung, until one of them is gone."""
        while bell.wait():
            there, call = loop(), rung()
            if there is None or call is None:
                break
            try:
                there.call_soon_threadsafe(call)
            except RuntimeError:  # The loop is closed, and whoever waited in it is gone.
                break
            del there, call


_loops: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, _Waiting] = weakref.WeakKeyDictionary()


async def wait(pending: Pending[Any]) -> Any:
    """Awaits an answer. Time on its way is given up if the task is cancelled meanwhile."""
    loop = asyncio.get_running_loop()
    waiting = _loops.get(loop)
    if waiting is None:
        waiting = _loops[loop] = _Waiting(loop)
    await waiting.wait(pending)
    return pending.result()


class _Line(asyncio.Transport):
    """The line of an emulator as a transport of asyncio."""

    def __init__(self, port: Port, protocol: asyncio.BaseProtocol) -> None:
        super().__init__()
        self._port = port
        self._protocol = protocol
        self._loop = asyncio.get_running_loop()
        self._out = bytearray()
        self._closing = False
        self._reads = asyncio.Event()
        self._reads.set()
        self._reader = self._loop.create_task(self._read())
        self._writer: asyncio.Task[None] | None = None

    async def _read(self) -> None:
        error: Exception | None = None
        try:
            while True:
                await self._reads.wait()
                data = await self._port.arrived()
                if not data:
                    break
                self._protocol.data_received(data)  # type: ignore[attr-defined]
            if not self._closing:
                self._protocol.eof_received()  # type: ignore[attr-defined]
        except Exception as raised:
            error = raised
        finally:
            self._closing = True
            self._port.close()
            self._protocol.connection_lost(error)

    async def _write(self) -> None:
        # A megabyte waits on the line: it is looked after now and then, until it is taken.
        self._protocol.pause_writing()
        while self._out and not self._port.closed:
            await asyncio.sleep(0.01)
            del self._out[: self._port.write(bytes(self._out), timeout=0)[0]]
        self._protocol.resume_writing()
        self._writer = None
        if self._closing:
            self._port.close()

    def write(self, data: Any) -> None:
        if self._closing:
            return
        data = bytes(data)
        if not self._out:
            data = data[self._port.write(data, timeout=0)[0] :]
        if data:
            self._out += data
            if self._writer is None:
                self._writer = self._loop.create_task(self._write())

    def close(self) -> None:
        self._closing = True
        if not self._out:
            self._port.close()

    def abort(self) -> None:
        self._out.clear()
        self.close()

    def is_closing(self) -> bool:
        return self._closing

    def pause_reading(self) -> None:
        self._reads.clear()

    def resume_reading(self) -> None:
        self._reads.set()

    def is_reading(self) -> bool:
        return self._reads.is_set()

    def can_write_eof(self) -> bool:
        return False

    def get_write_buffer_size(self) -> int:
        return len(self._out)

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return self._port if name == "port" else default


class Aio:
    """The controls of an emulator, to be awaited: every method is that of the same name of
    `Emulator`. What is asked for takes effect in the order of the calls, whether or not anybody
    awaits it. A task that is cancelled while time is on its way gives that way up."""

    __slots__ = ("_emulator",)

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator

    @property
    def _core(self) -> _vimc4.Core:
        return self._emulator._core

    async def connect(
        self, limit: int = 2**16
    ) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        """Opens the line from within the process, as the two streams that asyncio gives for any
        connection. It is closed with the writer."""
        port = await self._core.connect()
        loop = asyncio.get_running_loop()
        reader = asyncio.StreamReader(limit=limit, loop=loop)
        protocol = asyncio.StreamReaderProtocol(reader, loop=loop)
        transport = _Line(port, protocol)
        protocol.connection_made(transport)
        return reader, asyncio.StreamWriter(transport, protocol, reader, loop)

    def ended(self) -> Pending[None]:
        """Comes when the emulator has ended, with the error if it has ended by itself."""
        return self._core.ended()

    def now(self) -> Pending[int]:
        """The controller's time, in nanoseconds."""
        return self._core.now()

    def advance(self, span: str | timedelta) -> Journey:
        """Moves time forward, with the clocks that do not run by themselves."""
        return self._core.advance(span)

    def run_until(self, condition: str) -> Journey:
        """Lets time pass up to the first instant at which the condition holds."""
        return self._core.run_until(condition)

    def run_until_idle(self) -> Journey:
        """Lets time pass until the controller does nothing any more."""
        return self._core.run_until("idle")

    def position(self) -> Pending[list[int]]:
        """The step counters of the axes, X first."""
        return self._core.position()

    def view(self) -> Pending[View]:
        """A picture of the controller."""
        return self._core.view()

    def commands(self) -> Pending[list[Command]]:
        """What the host sent, decoded, oldest first."""
        return self._core.commands()

    def next_command(self, mnemonic: str) -> Pending[Command]:
        """The next command of this mnemonic that the host sends."""
        return self._core.next_command(mnemonic)

    def events(self) -> Pending[list[Event]]:
        """What happened, oldest first."""
        return self._core.events()

    def conversation(self) -> Pending[str]:
        """The conversation so far, as people read it."""
        return self._core.conversation()

    def forget(self) -> Pending[None]:
        """Forgets the commands, the events and the conversation so far."""
        return self._core.forget()

    async def reports(
        self, *wants: str, room: int = 10_000
    ) -> AsyncIterator[Report]:
        """What happens from now on, as it happens: ``async for report in emulator.aio.reports()``."""
        reports = self._emulator.reports(*wants, room=room)
        while (report := await reports.next_report()) is not None:
            yield report

    def coverage(self) -> Pending[Coverage]:
        """How much of what it can do the host has met."""
        return self._core.coverage()

    def journal(self) -> Pending[Journal]:
        """Everything that happened, oldest first."""
        return self._core.journal()

    def end_faults(self) -> Pending[Effect]:
        """Ends all faults, whoever has begun them."""
        return self._core.end_faults()

    def faults(self) -> Pending[list[FaultView]]:
        """The present faults, and how often each has struck."""
        return self._core.faults()

    def rules(self) -> Pending[list[RuleView]]:
        """The rules of the present scenarios, and how often each has acted."""
        return self._core.rules()

    def end_scenarios(self) -> Pending[Effect]:
        """Ends all scenarios, whoever has begun them."""
        return self._core.end_scenarios()

    def reset(self) -> Pending[Effect]:
        """Ends all scenarios and all faults, whoever has begun them."""
        return self._core.reset()

    def signals(self) -> Pending[list[Signal]]:
        """What can be pressed, turned and set."""
        return self._core.signals()

    def order(self, line: str) -> Pending[str]:
        """Carries out an order as people type it, and says what comes of it."""
        return self._core.order(line)

    def set_signal(self, name: str, value: int) -> Pending[Effect]:
        """Sets a signal to any value it takes."""
        return self._core.set_signal(name, value)

    def press(self, button: str) -> Pending[Effect]:
        """Presses a button and releases it."""
        return self._core.press(button)

    def hold(self, button: str) -> Pending[Effect]:
        """Presses a button and keeps it pressed."""
        return self._core.hold(button)

    def release(self, button: str) -> Pending[Effect]:
        """Releases a button."""
        return self._core.release(button)

    def turn(self, switch: str, position: str) -> Pending[Effect]:
        """Puts a switch into a position."""
        return self._core.turn(switch, position)

    def input(self, port: int, bit: int, level: bool) -> Pending[Effect]:
        """Sets a bit of an input port."""
        return self._core.input(port, bit, level)

    def erase(self) -> Pending[Effect]:
        """Erases the stored program as a person does at the panel."""
        return self._core.erase()

    def power(self, on: bool) -> Pending[Effect]:
        """Takes the power away or gives it back."""
        return self._core.power(on)

    def snapshot(self) -> Pending[Snapshot]:
        """The present state."""
        return self._core.snapshot()

    def restore(self, snapshot: Snapshot) -> Pending[None]:
        """Goes back to a state taken earlier."""
        return self._core.restore(snapshot)

    def harness(self) -> Pending[Harness]:
        """A copy of the controller as it is now, in virtual time."""
        return self._core.harness()

    def put(self, harness: Harness) -> Pending[None]:
        """Goes on from where a copy of the controller is."""
        return self._core.put(harness)

    def pause(self) -> Pending[int]:
        """Pauses time, and says when that was."""
        return self._core.pause()

    def resume(self) -> Pending[int]:
        """Time goes on."""
        return self._core.resume()

    def paused(self) -> Pending[Pause | None]:
        """Since when time is paused, and why."""
        return self._core.paused()

    def until_paused(self) -> Pending[Pause]:
        """Comes when time is paused, by whomever or whatever."""
        return self._core.until_paused()

    def step(self) -> Pending[Step]:
        """Does one thing while time is paused."""
        return self._core.step()

    def hear(self, size: int) -> Pending[int]:
        """Takes in no more than so many bytes that wait on the line, although time is paused."""
        return self._core.hear(size)

    def break_when(self, condition: str) -> Pending[int]:
        """Pauses time whenever a condition becomes true."""
        return self._core.break_when(condition)

    def remove_breakpoint(self, breakpoint: int) -> Pending[bool]:
        """Takes a breakpoint away, and says whether it was there."""
        return self._core.remove_breakpoint(breakpoint)

    def breakpoints(self) -> Pending[list[Breakpoint]]:
        """The breakpoints, and how often each was met."""
        return self._core.breakpoints()
