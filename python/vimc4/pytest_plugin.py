"""The fixture ``vimc4`` and the marker of the same name, for pytest.

    @pytest.mark.vimc4(model="imc-s8", machine="mill", time="manual")
    def test_stop(vimc4):
        port = vimc4.serial()
        ...

A test that fails shows the conversation in its report, and leaves a recording that ``vimc4 replay``
and ``vimc4 console`` open. Emulators live in the process of the test, on ports and in folders of their
own: with ``pytest -n`` each worker has its own, and whatever ends the process ends them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generator, Iterator

import pytest

if TYPE_CHECKING:
    from typing import Protocol

    from . import Emulator

    class StartsEmulators(Protocol):
        """Starts an emulator: see `vimc4.Emulator`."""

        def __call__(self, model: Any = ..., machine: Any = ..., **options: Any) -> Emulator: ...


_EMULATORS: pytest.StashKey[list[Emulator]] = pytest.StashKey()


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "vimc4(model, machine, time, **options): which virtual controller the fixture vimc4 is; the "
        "options are those of vimc4.Emulator. Of several markers the nearest decides, option by "
        "option. Without it: model='imc4', machine='bench', time='instant'.",
    )


@pytest.fixture
def vimc4_start(request: pytest.FixtureRequest) -> Iterator[StartsEmulators]:
    """Starts as many emulators as wanted: a function that takes what `vimc4.Emulator` does. What is
    not said is as the marker ``vimc4`` has it. They end with the test, and are in its report."""
    from . import Emulator

    node: pytest.Item = request.node
    marked = _marked(node)
    emulators = node.stash.setdefault(_EMULATORS, [])

    def start(*args: Any, **options: Any) -> Emulator:
        names = ("model", "machine", "time")
        options = marked | dict(zip(names, args)) | options
        if "recording" not in options and "record_failure" not in options:
            number = f"-{len(emulators) + 1}" if emulators else ""
            folder = request.getfixturevalue("tmp_path")
            options["record_failure"] = folder / f"vimc4{number}.jsonl"
            options.setdefault("recorded_by", f"pytest {node.nodeid}")
        emulator = Emulator(**options)
        emulators.append(emulator)
        return emulator

    yield start
    for emulator in emulators:
        emulator.close()


@pytest.fixture
def vimc4(vimc4_start: StartsEmulators) -> Emulator:
    """A virtual controller, as the marker ``vimc4`` has it; without one it is an IMC4 on the machine
    ``bench`` with the clock ``instant``."""
    return vimc4_start()


def _marked(node: pytest.Item) -> dict[str, Any]:
    """The options of all markers; the nearest comes last."""
    options: dict[str, Any] = {"time": "instant"}
    for mark in reversed(list(node.iter_markers("vimc4"))):
        options |= dict(zip(("model", "machine", "time"), mark.args))
        options |= mark.kwargs
    return options


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        for emulator in item.stash.get(_EMULATORS, []):
            report.sections += _sections(emulator)
    return report


def _sections(emulator: Emulator) -> list[tuple[str, str]]:
    """What a report says of an emulator: what was spoken, and where the recording is, which ends
    here."""
    title = f"vimc4 {emulator.name}, {emulator.model}"
    sections = [(f"{title}: conversation", emulator.conversation())]
    if emulator.recording is not None and not emulator.closed:
        emulator.keep_recording()
        files = emulator.recording.finish()
        again = "\n".join(f"vimc4 replay {file}\nvimc4 console {file}" for file in files)
        sections.append((f"{title}: recording", again))
    return sections
