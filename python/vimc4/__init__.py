"""Virtual stepper controllers for tests: those of isel, and LPKF's SMCU and MotionSystem.

An `Emulator` behaves like the real controller, byte for byte, in the process of the test: behind a
port of pyserial, a pseudo-terminal or TCP. Its machine, its operating panel and, if wanted, its time
are in the hands of the test.

>>> import vimc4
>>> emulator = vimc4.Emulator(time="instant")
>>> port = emulator.connect()
>>> port.write(b"@01\\r@0A100000,200\\r")
18
>>> port.read(2)
b'00'
>>> emulator.position()
[100000, 0, 0, 0]
>>> emulator.close()

With pytest, the fixture ``vimc4`` is an emulator, and ``@pytest.mark.vimc4(model=…, machine=…,
time=…)`` says which.
"""

from typing import TYPE_CHECKING as _TYPE_CHECKING

from ._emulator import Emulator, Reports
from ._errors import (
    Cancelled,
    ConditionError,
    ControlError,
    CoverageError,
    CoverageFileError,
    DeedError,
    Ended,
    Endless,
    Error,
    FaultError,
    FlashError,
    Late,
    LineWarning,
    Mistake,
    Never,
    OrderError,
    PortError,
    ProfileError,
    RecordingError,
    RecordingWarning,
    Refused,
    ScenarioError,
    Unfinished,
    Unmet,
)
from ._journal import Journal
from ._port import Port
from ._scope import Fault, Scenario, Watched
from ._types import Breakpoint, Command, Effect, FaultView, Move, Pause, Progress, RuleView, Signal
from ._vimc4 import (
    Coverage,
    Expect,
    Group,
    GroupState,
    Harness,
    Journey,
    Machine,
    Member,
    Model,
    Pending,
    Recording,
    Sentence,
    Snapshot,
    Worker,
    World,
    __version__,
    machine_profile,
    machines,
    model_profile,
    models,
)

__all__ = [
    "Aio",
    "Breakpoint",
    "Cancelled",
    "Command",
    "ConditionError",
    "ControlError",
    "Coverage",
    "CoverageError",
    "CoverageFileError",
    "DeedError",
    "Effect",
    "Emulator",
    "Ended",
    "Endless",
    "Error",
    "Expect",
    "Fault",
    "FaultError",
    "FaultView",
    "FlashError",
    "Group",
    "GroupState",
    "Harness",
    "Journal",
    "Journey",
    "Late",
    "LineWarning",
    "Machine",
    "Member",
    "Mistake",
    "Model",
    "Move",
    "Never",
    "OrderError",
    "Pause",
    "Pending",
    "Port",
    "PortError",
    "ProfileError",
    "Progress",
    "Recording",
    "RecordingError",
    "RecordingWarning",
    "Refused",
    "Remote",
    "Reports",
    "RuleView",
    "Scenario",
    "ScenarioError",
    "Sentence",
    "Signal",
    "Snapshot",
    "Sweep",
    "Swept",
    "Unfinished",
    "Unmet",
    "Watched",
    "Worker",
    "World",
    "__version__",
    "connect",
    "machine_profile",
    "machines",
    "model_profile",
    "models",
    "sweep",
]

if _TYPE_CHECKING:
    from ._aio import Aio
    from ._remote import Remote, connect
    from ._sweep import Sweep, Swept, sweep


def __getattr__(name: str) -> object:
    # asyncio takes longer to import than everything else together, and concurrent.futures not less.
    if name == "Aio":
        from ._aio import Aio

        return Aio
    if name in ("Sweep", "Swept", "sweep"):
        from . import _sweep

        return getattr(_sweep, name)
    if name in ("Remote", "connect"):
        from . import _remote

        return getattr(_remote, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


try:
    import serial as _serial
except ImportError:
    # Without pyserial there are `Emulator.connect`, pseudo-terminals and TCP.
    pass
else:
    # For `serial.serial_for_url("vimc4://imc-s8?time=instant")`.
    _serial.protocol_handler_packages.append("vimc4.urlhandler")
    del _serial
