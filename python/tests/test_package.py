"""The package as a whole: what is promised of types, errors, threads, signals and the end."""

import copy
import doctest
import gc
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from datetime import timedelta
from pathlib import Path

import pytest
import vimc4 as virtual


def run(code, *, code_of_end=0):
    """Runs a program, and returns what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == code_of_end, done.stderr
    return done.stdout


def test_what_is_left_to_the_end_of_the_program_is_told_there():
    for ends, exit_code in (("", 0), ("emulator.close()", 1)):
        program = f"import vimc4\nemulator = vimc4.Emulator()\nemulator.expect().command('@A').once().watch()\n{ends}"
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
        assert done.returncode == exit_code
        assert "vimc4._errors.Unmet: " in done.stderr
        assert ("too late for its exit code; check() or close()" in done.stderr) == (exit_code == 0)


def test_types_are_right(root):
    folder = root / "python"
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", str(folder / "pyproject.toml")],
        cwd=folder, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_stubs_say_what_there_is(tmp_path):
    # What is installed is looked at, not what it was made from.
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "vimc4._vimc4"],
        cwd=tmp_path, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_mistakes_are_found_by_a_type_checker(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import vimc4\n"
        "emulator = vimc4.Emulator(modl='imc4')\n"
        "emulator.runs_until('x = 5')\n"
        "at: str = emulator.now()\n"
        "emulator.view()['axis']\n"
        "async def wait() -> None:\n"
        "    at: str = await emulator.aio.now()\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), str(program)],
        cwd=tmp_path, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    wrong = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert [int(line.split(":")[1]) for line in wrong] == [2, 3, 4, 5, 7], done.stdout


def test_what_the_documentation_says_in_the_code_is_so():
    for module in (virtual, sys.modules["vimc4._emulator"]):
        done = doctest.testmod(module)
        assert done.attempted > 1 and done.failed == 0


def test_everything_is_documented():
    undocumented = [
        f"{kind.__name__}.{name}"
        for kind in vars(virtual).values()
        if isinstance(kind, type)
        for name, member in vars(kind).items()
        if not name.startswith("_")
        and (callable(member) or isinstance(member, property) or type(member).__name__ == "getset_descriptor")
        and not member.__doc__
        and not hasattr(vars(kind.__mro__[1]).get(name), "__doc__")
    ]
    assert undocumented == []
    assert all(getattr(virtual, name) is not None for name in virtual.__all__)


def test_async_methods_are_the_same():
    both = {
        name
        for name in dir(virtual.Emulator)
        if not name.startswith("_") and callable(getattr(virtual.Emulator, name))
    }
    # What does not wait, or is there for those who wait.
    here_only = {
        "serial", "close", "stop", "unlink", "keep_recording", "cancel_all", "complete", "expect", "check",
        "fault", "scenario",
    }  # fmt: skip
    assert both - here_only == {name for name in dir(virtual.Aio) if not name.startswith("_")}


@pytest.mark.parametrize(
    ("does", "error", "kind", "says"),
    [
        (lambda e: virtual.Emulator(time="fast"), ValueError, ValueError, "`fast` is not a clock"),
        (lambda e: virtual.Emulator(machine="drill"), virtual.ProfileError, ValueError, "built in are"),
        (lambda e: virtual.Emulator("no/such.toml"), virtual.ProfileError, ValueError, "cannot read"),
        (lambda e: virtual.Model("family = 5"), virtual.ProfileError, ValueError, ""),
        (lambda e: virtual.Emulator(tcp="nowhere"), virtual.PortError, OSError, "write host:port"),
        (lambda e: virtual.Emulator(serial="/dev/null/x"), virtual.PortError, OSError, "/dev/null/x"),
        (lambda e: virtual.Emulator(recording="/dev/null/x"), virtual.RecordingError, OSError, "x"),
        (lambda e: virtual.Emulator(flash="/dev/null/x"), virtual.FlashError, OSError, "x"),
        (lambda e: virtual.Emulator(tcp_clients="all"), ValueError, ValueError, "refuse, takeover"),
        (lambda e: virtual.Harness(flash=b"\xff"), virtual.FlashError, OSError, ""),
        (lambda e: e.run_until("x ="), virtual.ConditionError, ValueError, "`x =` is not finished"),
        (lambda e: e.run_until("x = 5"), virtual.Never, virtual.ControlError, "never happens"),
        (lambda e: e.press("doorbell"), virtual.DeedError, ValueError, "doorbell"),
        (lambda e: e.turn("cover", "ajar"), virtual.DeedError, ValueError, "open or closed"),
        (lambda e: e.order("dance"), virtual.OrderError, ValueError, "dance"),
        (lambda e: e.order(""), virtual.OrderError, ValueError, "empty"),
        (lambda e: e.advance("5"), ValueError, ValueError, "has no unit of time"),
        (lambda e: e.advance(5), TypeError, TypeError, "250ms"),
        (lambda e: e.advance(timedelta(-1)), TypeError, TypeError, "not negative"),
        (lambda e: e.next_command("@0A"), virtual.DeedError, ValueError, "has the mnemonic `@0A`; there are @axes, @A,"),
        (lambda e: e.next_command("@A", timeout=0.01), virtual.Late, TimeoutError, "within 0.01 s"),
        (lambda e: e.reports("weather"), ValueError, ValueError, "there are command, answer"),
    ],
)  # fmt: skip
@pytest.mark.vimc4(time="manual")
def test_errors_say_what_is_wrong(vimc4, does, error, kind, says):
    with pytest.raises(error) as raised:
        does(vimc4)
    assert isinstance(raised.value, kind) and says in str(raised.value)


@pytest.mark.vimc4(time="real")
def test_real_time_is_waited_for_no_longer_than_wanted(vimc4):
    with pytest.raises(virtual.ControlError, match="time moves by itself"):
        vimc4.advance("1s")
    port = vimc4.serial()
    port.write(b"@07\r@0A5000,900,0,900,0,900,0,900\r")
    with pytest.raises(virtual.Late):
        vimc4.run_until("x = 5000", timeout=0.01)
    assert vimc4.press("stop") == (True, None)
    effect = vimc4.turn("cover", "closed")
    assert not effect and effect.why == "it was so already"


@pytest.mark.vimc4(time="real")
def test_whoever_waits_lets_others_run(vimc4):
    ticks = 0
    waiting = threading.Thread(target=vimc4.until_paused)
    waiting.start()
    while ticks < 100_000:
        ticks += 1
    assert waiting.is_alive()
    vimc4.pause()
    waiting.join(60)
    assert not waiting.is_alive()


@pytest.mark.parametrize(
    "waits",
    [
        "emulator.run_until('x = 5000')",
        "emulator.until_paused()",
        "emulator.next_command('@B', timeout=None)",
        "emulator.serial(timeout=None).read()",
        "list(emulator.reports())",
    ],
)
def test_ctrl_c_ends_any_waiting(waits):
    program = f"""
        import vimc4
        emulator = vimc4.Emulator(time="real")
        port = emulator.connect()
        port.write(b"@07\\r@0A5000,900,0,900,0,900,0,900\\r")
        port.read()
        print("waits", flush=True)
        try:
            {waits}
        except KeyboardInterrupt:
            # The emulator is as well as ever, and waits for nothing.
            emulator.press("stop")
            print(emulator.commands()[-1].mnemonic)
    """
    started = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert started.stdout.readline() == "waits\n"
        time.sleep(0.1)
        started.send_signal(signal.SIGINT)
        assert started.communicate(timeout=60)[0] == "@A\n"
        assert started.returncode == 0
    finally:
        started.kill()
        started.wait(timeout=60)
        started.stdout.close()


def test_a_program_ends_with_its_emulators(tmp_path):
    link = tmp_path / "controller"
    # Of one that was never closed, of one in a cycle, of one whose thread waits, of one that failed.
    run(
        f"""
        import threading, vimc4
        emulator = vimc4.Emulator(pty={str(link)!r})
        cycle = vimc4.Emulator()
        cycle.itself = cycle
        threading.Thread(target=vimc4.Emulator().until_paused, daemon=True).start()
        try:
            vimc4.Emulator("imc-s9")
        except vimc4.Error:
            pass
        """
    )
    assert not os.path.lexists(link)


def test_what_nobody_has_any_more_ends():
    def threads():
        names = [task / "comm" for task in Path("/proc/self/task").iterdir()]
        return sum(name.read_text().startswith("vimc4") for name in names)

    before = threads()
    emulator = virtual.Emulator()
    emulator.itself = emulator
    # A thread gives itself its name.
    while threads() == before:
        time.sleep(0.001)
    del emulator
    gc.collect()
    assert threads() == before


def test_a_copy_of_the_process_has_no_emulators(tmp_path):
    link = tmp_path / "controller"
    said = run(
        f"""
        import os, sys, vimc4
        emulator = vimc4.Emulator(pty={str(link)!r})
        child = os.fork()
        if child == 0:
            try:
                emulator.now()
            except vimc4.Ended as error:
                print(error)
            emulator.close()
            del emulator
            with vimc4.Emulator(time="instant") as mine:
                print(mine.advance("1s"))
            sys.exit(0)
        os.waitpid(child, 0)
        print(os.path.islink(emulator.port), emulator.now() > 0)
        """
    )
    first, *others = said.splitlines()
    assert "lives in the process that has started it" in first
    assert others == ["1000000000", "True True"]


def test_a_copy_of_the_process_has_no_ports():
    said = run(
        """
        import os, serial, sys, warnings, vimc4
        warnings.simplefilter("ignore", DeprecationWarning)
        emulator = vimc4.Emulator(name="mine", time="instant")
        port, plain = emulator.serial(timeout=1), emulator.connect(timeout=1)
        child = os.fork()
        if child == 0:
            def set_timeout():
                port.timeout = 5

            def set_rts():
                port.rts = False

            for use in (
                lambda: port.write(b"@07\\r"), port.read, lambda: port.in_waiting, lambda: port.cts,
                port.reset_input_buffer, set_timeout, set_rts, plain.read, lambda: plain.write(b"x"),
            ):
                try:
                    print("quiet", use())
                except (serial.SerialException, vimc4.Ended) as error:
                    print(type(error).__name__, "lives in the process that has started it" in str(error))
            print(emulator, port.dsr)
            port.cancel_read()
            port.cancel_write()
            port.close()
            plain.close()
            print(port.is_open)
            del port, plain
            sys.exit(0)
        assert os.waitpid(child, 0)[1] == 0
        port.write(b"@07\\r")
        print(port.read(), plain.read())
        """
    )
    assert said.splitlines() == [
        *["SerialException True"] * 7,
        *["Ended True"] * 2,
        "<vimc4.Emulator mine, in another process> False",
        "False",
        "b'0' b'0'",
    ]


def test_daemons_end_in_silence():
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(DAEMONS)], capture_output=True, text=True, timeout=120
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "waits\nwaits\nwaits\n", "")


DAEMONS = """
import threading, time, vimc4

emulator = vimc4.Emulator(time="manual")
port, other = emulator.serial(timeout=None), emulator.serial()

def looks():
    while True:
        other.in_waiting
        other.write(b"@0P\\r")
        other.reset_input_buffer()

def reads():
    while True:
        port.read(10**9)

for what in (reads, looks, emulator.until_paused):
    thread = threading.Thread(target=what, daemon=True)
    thread.start()
    print("waits")
time.sleep(0.2)
"""


def test_an_emulator_is_not_copied():
    with virtual.Emulator(time="instant") as emulator:
        for way in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match=r"snapshot\(\) keeps its state"):
                way(emulator)
        gc.collect()
        assert not emulator.closed
        assert emulator.now() == 0


def test_one_that_has_not_started_can_be_shown():
    emulator = virtual.Emulator.__new__(virtual.Emulator)
    with pytest.raises(virtual.ProfileError):
        emulator.__init__("imc-s9")
    assert repr(emulator) == "<vimc4.Emulator that has not started>"


def test_a_recording_stays_if_the_block_fails(tmp_path):
    for name, error in (("passes", None), ("fails", ZeroDivisionError)):
        try:
            with virtual.Emulator(record_failure=tmp_path / name) as emulator:
                recording = emulator.recording
                assert recording.is_open
                if error:
                    raise error
        except ZeroDivisionError:
            pass
        assert not recording.is_open
    assert [path.name for path in tmp_path.iterdir()] == ["fails"]


def test_a_recording_that_cannot_be_written_is_told_of():
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full")
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        with pytest.raises(virtual.RecordingError):
            virtual.Emulator(recording="/dev/full")


def test_a_snapshot_is_of_one_model_and_machine(vimc4):
    snapshot = vimc4.snapshot()
    assert snapshot == vimc4.snapshot()
    vimc4.advance("1s")
    assert snapshot != vimc4.snapshot()
    vimc4.restore(snapshot)
    assert vimc4.now() == 0 and snapshot == vimc4.snapshot()
    for model, machine in (("smcu", "board-plotter"), ("imc-s8", "bench"), ("imc4", "mill")):
        with virtual.Emulator(model, machine) as other:
            says = f"this is a state of imc4 on bench, and this controller is {model} on {machine}"
            with pytest.raises(virtual.ControlError, match=says):
                other.restore(snapshot)
            assert other.view()["model"] == other.model


def test_its_parts_show_what_they_are(vimc4):
    assert repr(vimc4).startswith("<vimc4.Emulator ") and "imc4" in repr(vimc4)
    names = {signal.name: signal for signal in vimc4.signals()}
    assert names["cover"].positions == ("open", "closed")
    assert names["estop"].latches and names["estop"].kind == "button"
    assert "imc-s8" in virtual.models() and "mill" in virtual.machines()
    assert virtual.machine_profile("mill").startswith("#") or "name" in virtual.machine_profile("mill")
    vimc4.input(0, 3, True)
    vimc4.forget()
    assert vimc4.commands() == vimc4.events() == [] and vimc4.conversation() == ""
    assert vimc4.remove_breakpoint(7) is False
    vimc4.stop()
    vimc4.ended(timeout=60)
    with pytest.raises(virtual.Ended):
        vimc4.now()


def test_the_import_brings_no_asyncio():
    assert run("import sys, vimc4; print('asyncio' in sys.modules)") == "False\n"
    assert run("import vimc4; print(vimc4.Aio.__name__)") == "Aio\n"


def test_it_does_without_pyserial():
    assert run(
        """
        import sys
        sys.modules["serial"] = None
        import vimc4
        with vimc4.Emulator(time="instant") as emulator:
            port = emulator.connect()
            port.write(b"@07\\r")
            print(port.read())
            try:
                emulator.serial()
            except ImportError:
                print("needs pyserial")
        """
    ).splitlines() == ["b'0'", "needs pyserial"]
