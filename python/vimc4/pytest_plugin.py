"""The fixture ``vimc4`` and the marker of the same name, for pytest.

    @pytest.mark.vimc4(model="imc-s8", machine="mill", time="manual")
    def test_stop(vimc4):
        port = vimc4.serial()
        ...

What a test expects (``vimc4.expect()…watch()``) is checked at its end, and faults and scenarios that it has
begun end with it. A test that fails shows the conversation in its report, and leaves a recording that ``vimc4 replay``
and ``vimc4 console`` open. Emulators live in the process of the test, on ports and in folders of their
own: with ``pytest -n`` each worker has its own, and whatever ends the process ends them.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generator, Iterator

import pytest

from . import _emulator
from ._emulator import Emulator, running
from ._errors import Error, Unfinished, Unmet
from ._scope import Marks, raise_first
from ._test_sweep import SWEPT, TRIAL, is_swept, swept
from ._vimc4 import Coverage, models

if TYPE_CHECKING:
    from typing import Protocol

    from ._vimc4 import Recording

    class StartsEmulators(Protocol):
        """Starts an emulator: see `vimc4.Emulator`."""

        def __call__(self, model: Any = ..., machine: Any = ..., **options: Any) -> Emulator: ...


_EMULATORS: pytest.StashKey[list[Emulator]] = pytest.StashKey()
_RECORDINGS: pytest.StashKey[list[Recording]] = pytest.StashKey()
_FAILED: pytest.StashKey[bool] = pytest.StashKey()
_AT_END: pytest.StashKey[Unmet | Unfinished] = pytest.StashKey()
_UNMET: pytest.StashKey[list[tuple[str, str]]] = pytest.StashKey()


_COVERAGE: pytest.StashKey[dict[str, Coverage]] = pytest.StashKey()
_WRITTEN: pytest.StashKey[list[tuple[str, bool]]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("vimc4", "virtual controllers")
    group.addoption(
        "--vimc4-sweep",
        action="store_true",
        help="run each test that has a virtual controller once more for each fault that can strike what it does; the "
        "marker vimc4_sweep does so with one test",
    )
    group.addoption(
        "--vimc4-coverage",
        metavar="FILE",
        help="count what of the protocol of the virtual controllers the tests meet, and add it to this file, "
        "which `vimc4 coverage` shows; `{model}` in its name stands for the model",
    )


def pytest_configure(config: pytest.Config) -> None:
    if name := config.getoption("--vimc4-coverage"):
        if not hasattr(config, "workerinput"):
            _refuse_unusable(name)
        met = config.stash[_COVERAGE] = {}

        def add(coverage: Coverage) -> None:
            _add(met, coverage)

        _emulator.covered = add
        if config.pluginmanager.hasplugin("xdist"):
            config.pluginmanager.register(_OfXdist(), "vimc4-xdist")
        config.add_cleanup(_no_more_coverage)
    config.addinivalue_line(
        "markers",
        "vimc4(model, machine, time, **options): which virtual controller the fixture vimc4 is; the "
        "options are those of vimc4.Emulator. Of several markers the nearest decides, option by "
        "option. Without it: model='imc4', machine='bench', time='instant'.",
    )
    config.addinivalue_line(
        "markers",
        "vimc4_sweep(harms=None, modes=None, limit=None): the test is run once more for each fault that can "
        "strike what it does with its controller, which is the only one; as vimc4.sweep.",
    )


def _refuse_unusable(name: str) -> None:
    """Nobody has to run all tests to learn that their coverage cannot be written."""
    for file in sorted({name.replace("{model}", model) for model in models()}):
        path, why = Path(file), None
        folder = path.resolve().parent
        if not folder.is_dir():
            why = f"there is no folder {folder}"
        elif path.exists() and not path.is_file():
            why = "it is not a regular file"
        elif not os.access(folder, os.W_OK):
            why = f"the folder {folder} cannot be written to"
        if why is not None:
            help = "name a file in a folder that can be written to"
            raise pytest.UsageError(f"cannot use the coverage file {file}: {why}; {help}")
        try:
            if path.exists() and path.stat().st_size > 0:
                Coverage.read(file)
        except Error as error:
            raise pytest.UsageError(str(error)) from None


def _add(met: dict[str, Coverage], more: Coverage) -> None:
    known = met.get(more.model)
    met[more.model] = more if known is None else known + more


def _no_more_coverage() -> None:
    _emulator.covered = None


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """What the tests have met is written; a worker of xdist hands it over."""
    met = session.config.stash.get(_COVERAGE, None)
    if met is None:
        return
    # Those of nobody's fixture go on to the end of the process.
    for emulator in list(running.values()):
        if not emulator.closed and (coverage := emulator._core.coverage_so_far()) is not None:
            _add(met, coverage)
    output = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["vimc4-coverage"] = [coverage.json() for coverage in met.values()]
        return
    written = session.config.stash[_WRITTEN] = list(_write(met, session.config.getoption("--vimc4-coverage")))
    if any(wrong for _, wrong in written) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


class _OfXdist:
    """What xdist alone knows of."""

    def pytest_testnodedown(self, node: Any) -> None:
        """A worker has ended."""
        met = node.config.stash.get(_COVERAGE, None)
        if met is not None:
            for text in getattr(node, "workeroutput", {}).get("vimc4-coverage", []):
                _add(met, Coverage.from_json(text))


def _write(met: dict[str, Coverage], name: str) -> Iterator[tuple[str, bool]]:
    """Adds to the files, and says what has come of it in lines, and of each whether something is wrong."""
    if not met:
        yield "no test has used an emulator of this process", False
    if len(met) > 1 and "{model}" not in name:
        models = ", ".join(sorted(met))
        yield (
            f"nothing is written: the tests have met several models, {models}, and each has a file of its own; "
            f"say where the model goes, as in --vimc4-coverage coverage-{{model}}.json"
        ), True
        return
    for model, coverage in sorted(met.items()):
        file = name.replace("{model}", model)
        try:
            totals = coverage.add_to(file).totals()
        except Error as error:
            yield str(error), True
            continue
        kinds = (
            (totals["commands"], "commands"),
            (totals["answers"], "answers"),
            (totals["states"], "states"),
            (totals["stops"], "causes of a stop"),
        )
        shares = ", ".join(f"{total['met']} of {total['possible']} {kind}" for total, kind in kinds)
        yield f"{model}: {shares}", False
        yield f"vimc4 coverage {file}", False


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    _summary_of_sweeps(terminalreporter)
    _summary_of_coverage(terminalreporter)


def _summary_of_sweeps(terminalreporter: pytest.TerminalReporter) -> None:
    lines = [
        f"{report.nodeid}: {words}"
        for outcome in ("passed", "failed", "xfailed", "xpassed")
        for report in terminalreporter.getreports(outcome)
        for name, words in report.user_properties
        if name == SWEPT and report.when == "call"
    ]
    if lines:
        terminalreporter.section("sweeps of vimc4")
        for line in lines:
            terminalreporter.line(line)


def _summary_of_coverage(terminalreporter: pytest.TerminalReporter) -> None:
    written = terminalreporter.config.stash.get(_WRITTEN, None)
    if written is not None:
        terminalreporter.section("coverage of vimc4")
        for line, wrong in written:
            terminalreporter.line(line, red=wrong)


@pytest.fixture
def vimc4_start(request: pytest.FixtureRequest) -> Iterator[StartsEmulators]:
    """Starts as many emulators as wanted: a function that takes what `vimc4.Emulator` does. What is
    not said is as the marker ``vimc4`` has it. They end with the test, and are in its report."""
    node: pytest.Item = request.node
    marked = _marked(node)
    emulators = node.stash[_EMULATORS] = []
    recordings = node.stash[_RECORDINGS] = []

    def start(*args: Any, **options: Any) -> Emulator:
        names = ("model", "machine", "time")
        options = marked | dict(zip(names, args)) | options
        if (trial := node.stash.get(TRIAL, None)) is not None:
            emulator = trial.start(options, request)
            emulators.append(emulator)
            return emulator
        ours = "recording" not in options and "record_failure" not in options
        if ours:
            number = f"-{len(emulators) + 1}" if emulators else ""
            folder = request.getfixturevalue("tmp_path")
            options["recording"] = folder / f"vimc4{number}.jsonl"
            options.setdefault("recorded_by", f"pytest {node.nodeid}")
        emulator = Emulator(**options)
        emulators.append(emulator)
        if ours and emulator.recording is not None:
            recordings.append(emulator.recording)
        return emulator

    yield start
    if (trial := node.stash.get(TRIAL, None)) is not None:
        trial.end()
    with ExitStack() as closing:
        for emulator in emulators:
            if _UNMET not in node.stash:
                # The test itself was never begun.
                Marks(()).outcome(emulator)
            closing.callback(emulator.close)


@pytest.fixture
def vimc4(vimc4_start: StartsEmulators) -> Emulator:
    """A virtual controller, as the marker ``vimc4`` has it; without one it is an IMC4 on the machine
    ``bench`` with the clock ``instant``."""
    return vimc4_start()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """A test is swept: it is run again and again, and reported once."""
    mark = item.get_closest_marker("vimc4_sweep")
    if mark is None and not item.config.getoption("--vimc4-sweep"):
        return None
    # A class or a module may be marked as a whole; a test that is marked itself is meant to have a controller.
    is_meant = any(one.name == "vimc4_sweep" for one in item.own_markers)
    if not isinstance(item, pytest.Function) or not (is_swept(item) or is_meant):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in swept(item, nextitem, mark):
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test that cannot be swept does not begin."""
    trial = item.stash.get(TRIAL, None)
    if trial is not None and trial.refusal is not None:
        raise trial.refusal


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """What a test expects is checked at its end, and what goes wrong by its order ends with it: of its
    own emulators, and of all others as far as the test itself has said so."""
    item.stash[_UNMET] = []
    own = item.stash.get(_EMULATORS, [])
    marks = Marks(emulator for emulator in running.values() if emulator not in own)
    try:
        yield
    except BaseException:
        unmet = _end_since(marks)
        item.stash[_UNMET] = [(f"{_title(of)}: not met", f"{error}\n") for of, error in unmet]
        raise
    if unmet := _end_since(marks):
        item.stash[_AT_END] = unmet[0][1]
        raise_first([error for _, error in unmet])
    trial = item.stash.get(TRIAL, None)
    if trial is not None and trial.failure is not None:
        raise trial.failure


def _end_since(marks: Marks) -> list[tuple[Emulator, Unmet | Unfinished]]:
    emulators = list(running.values())
    for emulator in emulators:
        marks.end_scoped(emulator)
    return [(emulator, unmet) for emulator in emulators for unmet in marks.outcome(emulator)]


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
    if (trial := item.stash.get(TRIAL, None)) is not None:
        trial.take(report, call)
        raised = None if call.excinfo is None else call.excinfo.value
        if raised is not None and raised is trial.refusal:
            # To expect a finding is no finding.
            report.outcome = "failed"
            vars(report).pop("wasxfail", None)
        if report.failed and raised is not None and (raised is trial.failure or raised is trial.refusal):
            # It was not raised by a line of the test, and the log of a run without a fault does not explain it.
            report.longrepr = str(raised)
            report.sections.clear()
        return report
    if report.when == "setup":
        item.stash[_FAILED] = False
    if report.failed:
        item.stash[_FAILED] = True
        if call.when == "call" and call.excinfo is not None:
            error = call.excinfo.value
            # What has failed is not told twice.
            unmet = item.stash.get(_UNMET, [])
            report.sections += [section for section in unmet if section[1] != f"{error}\n"]
            if item.stash.get(_AT_END, None) is error:
                # It was not raised by a line of the test.
                place = "" if error.place is None else f"{error.place}: expected here, and not met\n\n"
                report.longrepr = f"{place}{error}"
        for emulator in item.stash.get(_EMULATORS, []):
            report.sections += _sections(emulator)
    # Whether all has gone well is known when its fixtures are taken down, too.
    if report.when == "teardown" and not item.stash.get(_FAILED, True):
        for recording in item.stash.get(_RECORDINGS, []):
            recording.discard()
    return report


def _title(emulator: Emulator) -> str:
    return f"vimc4 {emulator.name}, {emulator.model}"


def _sections(emulator: Emulator) -> list[tuple[str, str]]:
    """What a report says of an emulator: what was spoken, and where the recording is, which ends
    here."""
    title = _title(emulator)
    sections = [(f"{title}: conversation", emulator.conversation())]
    if emulator.recording is not None:
        emulator.keep_recording()
        try:
            files = emulator.recording.finish()
        except OSError as error:
            # Its folder may be gone already.
            again = str(error)
        else:
            again = "\n".join(f"vimc4 replay {file}\nvimc4 console {file}" for file in files)
        sections.append((f"{title}: recording", again))
    return sections
