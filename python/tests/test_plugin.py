"""The plugin of pytest."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

MOVES = '''
import pytest

MOVE = b"@0A100,900,0,900,0,900,0,900\\r"

@pytest.fixture
def port(vimc4):
    with vimc4.serial() as port:
        port.write(b"@07\\r")
        assert port.read() == b"0"
        yield port
'''


def test_a_controller_is_a_fixture(pytester):
    pytester.makepyfile(
        """
        import pytest

        def test_without_a_marker(vimc4):
            view = vimc4.view()
            assert (view["model"], view["machine"]) == ("imc4", "bench")
            assert vimc4.advance("1s") == 1_000_000_000

        @pytest.mark.vimc4("imc-s8", "mill", "manual")
        def test_by_place(vimc4):
            view = vimc4.view()
            assert (view["model"], view["machine"]) == ("imc-s8", "mill")

        @pytest.mark.vimc4(model="imc-s8", time="manual")
        class TestMarkers:
            @pytest.mark.vimc4(machine="mill")
            def test_are_of_classes_and_functions(self, vimc4):
                view = vimc4.view()
                assert (view["model"], view["machine"]) == ("imc-s8", "mill")

            @pytest.mark.vimc4(model="imc4")
            @pytest.mark.vimc4(tcp="127.0.0.1:0")
            def test_and_the_nearest_decides(self, vimc4):
                assert vimc4.model == "imc4" and vimc4.tcp_addr[1] != 0

        @pytest.mark.vimc4(machine="mill")
        def test_several(vimc4, vimc4_start):
            other = vimc4_start("imc-s8")
            assert other.model == "imc-s8" and other.view()["machine"] == "mill"
            assert vimc4.name != other.name

        @pytest.mark.vimc4(model="imc-s9")
        def test_a_wrong_name(vimc4):
            pass
        """
    )
    result = pytester.runpytest("--strict-markers")
    result.assert_outcomes(passed=5, errors=1)
    result.stdout.fnmatch_lines(["*there is no model `imc-s9`; built in are*"])
    result.stdout.no_fnmatch_line("*raised in repr()*")


def test_markers_are_explained(pytester):
    result = pytester.runpytest("--markers")
    result.stdout.fnmatch_lines(["@pytest.mark.vimc4(model, machine, time, ?*options): which*"])


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["alone", "xdist"])
def test_who_fails_shows_the_conversation_and_leaves_a_recording(pytester, workers):
    pytester.makepyfile(
        MOVES
        + """
def test_passes(port):
    port.write(MOVE)
    assert port.read() == b"0"

def test_fails(port, vimc4, vimc4_start):
    vimc4_start("imc-s8").serial().write(b"@01\\r")
    port.write(MOVE)
    assert port.read() == b"F"
"""
    )
    base = pytester.path / "kept"
    result = pytester.runpytest_subprocess("--basetemp", base, *workers)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            "*assert b'0' == b'F'*",
            "*vimc4 *, imc4: conversation*",
            "*@0A100,900,0,900,0,900,0,900  relative move X +100 steps at 900 Hz*",
            "*0  after * ms*",
            "*vimc4 *, imc4: recording*",
            "vimc4 replay *vimc4.jsonl",
            "vimc4 console *vimc4.jsonl",
            "*vimc4 *, imc-s8: conversation*",
            "*@01  set axes X*",
            "vimc4 replay *vimc4-2.jsonl",
        ]
    )
    # What passes leaves nothing.
    files = sorted(base.rglob("*.jsonl"))
    assert [file.name for file in files] == ["vimc4-2.jsonl", "vimc4.jsonl"]
    assert all("end" in last_line(file) for file in files)
    lines = [json.loads(line) for line in files[1].read_text().splitlines()]
    assert lines[0]["from"] == f"pytest {Path(str(pytester.path)).name}.py::test_fails" or (
        lines[0]["from"].endswith("::test_fails")
    )
    assert "passes" not in result.stdout.str().replace("test_passes", "")


def last_line(file):
    return json.loads(file.read_text().splitlines()[-1])


@pytest.mark.parametrize("policy", ["all", "failed"])
def test_whoever_fails_leaves_a_recording(pytester, policy):
    pytester.makeini(f"[pytest]\ntmp_path_retention_policy = {policy}")
    pytester.makepyfile(
        MOVES
        + """
@pytest.fixture
def ends_badly(port):
    yield
    port.write(MOVE)
    assert port.read() == b"F"

def test_of_a_fixture(ends_badly):
    pass

def test_closes(vimc4, port):
    port.write(MOVE)
    assert port.read() == b"0"
    vimc4.close()
    assert False

def test_has_ended(vimc4_start):
    with vimc4_start() as emulator:
        emulator.serial().write(MOVE)
    assert False

def test_closes_and_passes(vimc4):
    vimc4.close()
"""
    )
    base = pytester.path / "kept"
    result = pytester.runpytest_subprocess("--basetemp", base)
    result.assert_outcomes(passed=2, failed=2, errors=1)
    # With that policy pytest removes the folder of a test that fails only after it.
    names = ["test_closes0", "test_has_ended0"] + ["test_of_a_fixture0"] * (policy == "all")
    files = sorted(base.rglob("*.jsonl"))
    assert [file.parent.name for file in files] == names
    assert all("end" in last_line(file) for file in files)
    for file in files:
        result.stdout.fnmatch_lines_random([f"vimc4 replay {file}"])


def test_who_fails_in_a_fixture_shows_it_too(pytester):
    pytester.makepyfile(
        MOVES
        + """
@pytest.fixture
def referenced(port):
    port.write(b"@0R7\\r")
    assert port.read() == b"9"

def test_never_comes_here(referenced):
    pass

@pytest.fixture
def expects(vimc4):
    vimc4.expect().command("@B").once().watch()

def test_nor_here(expects, referenced):
    pass

@pytest.fixture
def ends_badly(port):
    yield
    port.write(MOVE)
    assert port.read() == b"F"

def test_comes_here(ends_badly):
    pass
"""
    )
    result = pytester.runpytest("--basetemp", pytester.path / "kept")
    result.assert_outcomes(passed=1, errors=3)
    text = result.stdout.str()
    assert text.count(": conversation") == 3
    assert "@0R7" in text and "@0A100" in text


@pytest.mark.vimc4(model="imc-s8")
def test_a_recording_of_ones_own_stays(pytester):
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.vimc4(recording="own.jsonl")
        def test_passes(vimc4):
            pass
        """
    )
    pytester.runpytest().assert_outcomes(passed=1)
    assert (pytester.path / "own.jsonl").exists()


def test_a_suite_of_two_hundred(pytester):
    pytester.makepyfile(
        MOVES
        + """
@pytest.mark.parametrize("number", range(200))
@pytest.mark.vimc4(pty=True, tcp="127.0.0.1:0")
def test_it(port, vimc4, number):
    port.write(MOVE * 3)
    assert port.read(3) == b"000"
    assert vimc4.position()[0] == 300
"""
    )
    began = time.monotonic()
    result = pytester.runpytest_subprocess("-n", "2", "-q", "--durations=3")
    result.assert_outcomes(passed=200)
    print(f"200 tests took {time.monotonic() - began:.1f} s")


def processes(marker):
    """The processes that have this in their environment."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if marker.encode() in (folder / "environ").read_bytes():
                found.add(int(folder.name))
        except OSError:
            pass
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM])
def test_nothing_is_left_of_what_is_killed(pytester, by):
    where = pytester.path / "where.json"
    link = pytester.path / "controller"
    pytester.makepyfile(
        f"""
        import json, os, time, pytest

        @pytest.mark.vimc4(pty={str(link)!r}, tcp="127.0.0.1:0")
        def test_hangs(vimc4):
            with open({str(where)!r} + "~", "w") as file:
                json.dump([os.readlink(vimc4.port), *vimc4.tcp_addr], file)
            os.rename({str(where)!r} + "~", {str(where)!r})
            time.sleep(600)
        """
    )
    marker = f"VIMC4_TEST_OF_KILL={os.getpid()}"
    key, value = marker.split("=")
    started = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider"],
        cwd=pytester.path,
        env=os.environ | {key: value},
        stdout=subprocess.DEVNULL,
    )
    try:
        begun = time.monotonic()
        while not where.exists():
            assert started.poll() is None
            assert time.monotonic() - begun < 60, f"waited 60 s for {where}"
            time.sleep(0.01)
        pty, host, port = json.loads(where.read_text())
        socket.create_connection((host, port)).close()
        # A controller is no process of its own.
        assert processes(marker) == {started.pid}
        terminal = select.poll()
        end = os.open(pty, os.O_RDWR | os.O_NOCTTY)
        terminal.register(end, 0)
        assert terminal.poll(0) == []
        started.send_signal(by)
        started.wait(timeout=60)
    finally:
        started.kill()
        started.wait(timeout=60)
    assert processes(marker) == set()
    # Its name may belong to somebody else by now.
    assert terminal.poll(0)[0][1] & select.POLLHUP
    os.close(end)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, port))
    # The link that was asked for leads nowhere: nobody can take it for a controller, and the next
    # one takes its place.
    assert not link.exists()
    again = f"import vimc4; vimc4.Emulator(pty={str(link)!r}).close()"
    subprocess.run([sys.executable, "-c", again], check=True, timeout=60)
    assert not os.path.lexists(link)


def test_what_is_expected_is_checked_with_the_test(pytester):
    pytester.makepyfile(
        MOVES
        + """
import vimc4 as virtual

def test_passes(vimc4, port):
    vimc4.expect().command("@A").once().watch()
    port.write(MOVE)

def test_forgets_to_move(vimc4):
    vimc4.expect().command("@A").once().watch()

def test_moves_too_far(vimc4, port):
    vimc4.expect().never("x > 50").watch()
    port.write(MOVE)
    assert port.read() == b"0"

def test_has_a_driver_that_swallows_it(vimc4, port):
    vimc4.expect().never("x > 50").watch()
    try:
        port.write(MOVE)
        port.read()
    except AssertionError:
        pass

def test_never_says_how_often(vimc4):
    vimc4.expect().command("@A")

def test_gives_up(vimc4):
    vimc4.expect().command("@B").once().watch()
    raise RuntimeError("the driver gave up")

@pytest.fixture
def moves(vimc4):
    vimc4.expect().command("@A").once().watch()

def test_of_a_fixture(moves):
    pass
"""
    )
    result = pytester.runpytest("--basetemp", pytester.path / "kept")
    result.assert_outcomes(passed=1, failed=6)
    result.stdout.fnmatch_lines(
        [
            "*test_forgets_to_move*",
            "*test_what*.py:*: expected here, and not met",
            "expected command @A, once",
            "  but it never came",
            "*test_moves_too_far*",
            ">*port.read() == b*",
            "E*Unmet: expected x > 50, never",
            "*: recording*",
            "*test_has_a_driver_that_swallows_it*",
            "expected x > 50, never",
            "*test_never_says_how_often*",
            "the sentence that begins at *test_what*.py:* has no end*",
            "*test_gives_up*",
            "E*RuntimeError: the driver gave up",
            "*: not met*",
            "expected command @B, once",
            "*: conversation*",
            "*test_of_a_fixture*",
            "expected command @A, once",
        ]
    )
    assert result.stdout.str().count(": not met") == 1


def test_what_goes_wrong_ends_with_the_test(pytester):
    pytester.makepyfile(
        """
        import pytest, vimc4

        @pytest.fixture(scope="module")
        def shared():
            with vimc4.Emulator(time="instant") as emulator:
                emulator.fault("delay 1ms to-host always")
                emulator.expect().command("@B").never().watch()
                yield emulator

        def test_begins_one(shared):
            shared.fault("cut")
            assert len(shared.faults()) == 2

        def test_has_none(shared):
            assert [view.number for view in shared.faults()] == [1]

        def test_expects_something(shared):
            shared.expect().command("@A").once().watch()

        def test_breaks_what_another_expects(shared):
            shared.connect().write(b"@0B2,1\\r")

        def test_fails(shared):
            shared.fault("cut")
            assert False

        def test_has_none_either(shared):
            assert [view.number for view in shared.faults()] == [1]

        @pytest.fixture(scope="module")
        def another():
            with vimc4.Emulator(time="instant") as emulator:
                emulator.expect().command("@B").once().watch()
                yield emulator

        def test_does_not_do_what_another_expects(another):
            pass
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(passed=4, failed=3, errors=1)
    result.stdout.fnmatch_lines(
        [
            "*ERROR at teardown of test_does_not_do*",
            "*expected command @B, once*",
            "*test_expects_something*",
            "*test_breaks_what_another_expects*",
            "expected command @B, never",
        ]
    )


COVERED = MOVES + """
import vimc4 as virtual

def test_moves(port):
    port.write(MOVE)
    assert port.read() == b"0"

def test_asks(port):
    port.write(b"@0P\\r")
    assert port.read(19)[:1] == b"0"

def test_has_one_of_its_own():
    with virtual.Emulator(time="instant") as emulator:
        emulator.connect().write(b"@01\\r@0R1\\r")
        emulator.run_until_idle()
        assert emulator.coverage().totals()["commands"]["met"] >= 2

@pytest.mark.vimc4(coverage=False)
def test_does_not_count(port):
    port.write(b"@0V\\r")
    port.read()
"""


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["alone", "xdist"])
def test_what_was_met_is_added_to_a_file(pytester, workers):
    import vimc4 as virtual

    pytester.makepyfile(COVERED)
    file = pytester.path / "met.json"
    for times in (1, 2):
        result = pytester.runpytest_subprocess(f"--vimc4-coverage={file}", *workers)
        result.assert_outcomes(passed=4)
        result.stdout.fnmatch_lines(
            ["*coverage of vimc4*", "imc4: * of * commands, * of * answers, *", f"vimc4 coverage {file}"]
        )
        coverage = virtual.Coverage.read(file)
        met = {
            command["mnemonic"]: sum(answer["met"] for answer in command["answers"])
            for command in coverage.commands()
        }
        assert (met["@A"], met["@P"], met["@R"], met["@V"]) == (times, times, times, 0)
    # Without the option nothing is counted.
    pytester.makepyfile(
        """
        import pytest, vimc4 as virtual

        def test_it(vimc4):
            with pytest.raises(virtual.ControlError):
                vimc4.coverage()
        """
    )
    pytester.runpytest_subprocess(*workers).assert_outcomes(passed=1)


def test_each_model_has_its_own_file(pytester):
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("model", ["imc4", "smcu"])
        def test_it(vimc4_start, model):
            vimc4_start(model)
        """
    )
    result = pytester.runpytest_subprocess("--vimc4-coverage=met.json")
    result.stdout.fnmatch_lines(["nothing is written: * imc4, smcu, *coverage-{model}.json"])
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert not (pytester.path / "met.json").exists()
    result = pytester.runpytest_subprocess("--vimc4-coverage=met-{model}.json")
    assert result.ret == pytest.ExitCode.OK
    result.stdout.fnmatch_lines(["imc4: 0 of *", "smcu: 0 of *"])
    assert (pytester.path / "met-smcu.json").exists()
    result = pytester.runpytest_subprocess("--vimc4-coverage=met-smcu.json", "-k", "imc4")
    result.stdout.fnmatch_lines(["*it covers the model smcu, and this is imc4*"])
    result.assert_outcomes(passed=1, deselected=1)
    assert result.ret == pytest.ExitCode.TESTS_FAILED


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["alone", "xdist"])
@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("no/met.json", "there is no folder */no; name a file"),
        ("no/{model}.json", "there is no folder */no; name a file"),
        ("/dev/full", "it is not a regular file; name a file"),
        (".", "it is not a regular file; name a file"),
        ("junk.json", "coverage file junk.json: "),
        ("junk-{model}.json", "coverage file junk-smcu.json: "),
    ],
)
def test_a_file_of_coverage_is_refused_before_the_first_test(pytester, file, says, workers):
    for junk in ("junk.json", "junk-smcu.json"):
        (pytester.path / junk).write_text("junk")
    pytester.makepyfile(COVERED)
    result = pytester.runpytest_subprocess(f"--vimc4-coverage={file}", *workers)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: *{says}*"])
    result.stdout.no_fnmatch_line("*passed*")


SWEPT = '''
import pytest
from stepper import Stepper

@pytest.fixture
def stepper(vimc4):
    with vimc4.serial(timeout=1) as port:
        yield Stepper(port)

@pytest.mark.vimc4("imc-s8", "mill")
@pytest.mark.vimc4_sweep(harms=["stop"], modes=["transient"])
def test_careless(stepper):
    stepper.reference()
    stepper.start_move_by(800, 0, 0, speed=900)
    stepper.port.read(1)

@pytest.mark.vimc4("imc-s8", "mill")
def test_careful(stepper):
    stepper.reference()
    stepper.move_by(80, 0, 0, speed=900)
    assert stepper.position() == (80, 0, 0)

def test_without_a_controller():
    pass
'''


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["alone", "xdist"])
def test_a_test_is_swept(pytester, monkeypatch, workers):
    pytester.makepyfile(SWEPT)
    drivers = Path(__file__).resolve().parents[2] / "examples" / "python"
    monkeypatch.setenv("PYTHONPATH", str(drivers), prepend=os.pathsep)
    swept = pytester.runpytest_subprocess(*workers)
    swept.assert_outcomes(passed=2, failed=1)
    swept.stdout.fnmatch_lines(
        [
            "*test_careless*",
            "it reports success, but the machine is not where it should be*",
            "  broken: STOP was pressed when *",
            "  did: went on as if nothing had happened; it returned",
            "  vimc4 replay *case-*.jsonl",
            "* points, * outcomes, * with something wrong",
        ]
    )
    swept.stdout.no_fnmatch_line("*test_careful*points*")
    # The recording of a case is that of its run.
    found = [line.split()[-1] for line in swept.outlines if line.startswith("  vimc4 replay ")]
    assert found and all("@0A800,900" in Path(file).read_text() for file in found)
    # By the option all are, and the worst that happens to a careful one is what no answer tells.
    swept = pytester.runpytest_subprocess("--vimc4-sweep", "-k", "careful or without", *workers)
    swept.assert_outcomes(passed=1, failed=1)
    swept.stdout.fnmatch_lines(["*heard: what it always hears", "*sweeps of vimc4*"])


MEANT = '''
import pytest
from stepper import Stepper

swept = pytest.mark.vimc4_sweep(harms=["stop"], modes=["transient"])
pytestmark = pytest.mark.vimc4("imc-s8", "mill")

def careless(vimc4, steps=800):
    stepper = Stepper(vimc4.serial(timeout=1))
    stepper.reference()
    stepper.start_move_by(steps, 0, 0, speed=900)
    stepper.port.read(1)

@swept
@pytest.mark.xfail
def test_known_finding(vimc4):
    careless(vimc4)

@swept
@pytest.mark.xfail(raises=AssertionError, strict=True)
def test_known_and_strict(vimc4):
    careless(vimc4)

@swept
@pytest.mark.xfail(strict=True)
def test_mended(vimc4):
    vimc4.expect().command("@A").answered("0").once().watch()
    careless(vimc4)

@swept
def test_that_closes(vimc4):
    careless(vimc4)
    vimc4.close()

@swept
def test_without_a_controller():
    pass

@pytest.fixture(scope="module")
def runs():
    return []

@swept
def test_with_a_memory(vimc4, runs):
    runs.append(1)
    careless(vimc4, len(runs))

@pytest.mark.vimc4_sweep(foo=3)
def test_option(vimc4):
    pass

@pytest.mark.vimc4_sweep(["stop"])
def test_position(vimc4):
    pass

@swept
def test_fetches_its_controller(request):
    careless(request.getfixturevalue("vimc4"))

@pytest.fixture(scope="module")
def tries():
    return []

@swept
def test_fails_now_and_then(vimc4, tries):
    careless(vimc4)
    tries.append(1)
    assert len(tries) > 1

@swept
class TestAll:
    def test_nothing_to_sweep(self):
        pass
'''


def test_what_a_sweep_means_for_a_test(pytester, monkeypatch):
    pytester.makepyfile(MEANT)
    drivers = Path(__file__).resolve().parents[2] / "examples" / "python"
    monkeypatch.setenv("PYTHONPATH", str(drivers), prepend=os.pathsep)
    swept = pytester.runpytest_subprocess("-rA")
    swept.assert_outcomes(xfailed=2, failed=3, passed=1, errors=5)
    swept.stdout.fnmatch_lines_random(
        [
            "*test_known_finding: * points, * outcomes, * with something wrong",
            "*[[]XPASS(strict)[]]*",
            "*test_mended: * points, * outcomes, none with something wrong",
            "*test_that_closes: * points, * outcomes, [1-9]* with something wrong",
            "it cannot be swept: the test has no controller among its arguments; name the fixture `vimc4` or *",
            "it cannot be swept: without a fault it fails one time, and another time it does not",
            "it cannot be swept: it does something else each time it runs: first it sent `@0A1,900*`, then it sent "
            "`@0A2,900*",
            "it cannot be swept: the marker vimc4_sweep has no option `foo`; it has harms, modes, limit",
            'it cannot be swept: the marker vimc4_sweep has named options only, as in vimc4_sweep(harms=*',
        ]
    )


ASSERTING = '''
import logging
import pytest
from stepper import Stepper, StepperError

pytestmark = [
    pytest.mark.vimc4("imc-s8", "mill"),
    pytest.mark.vimc4_sweep(harms=["stop"], modes=["transient"]),
]

class Careless(Stepper):
    def move_by(self, x, y, z, speed):
        logging.warning("a move begins")
        print("it moves")
        self.start_move_by(x, y, z, speed)
        return self.port.read(1).decode()

def is_there(stepper):
    assert stepper.position() == (800, 0, 0)

def test_of_the_end_state(vimc4):
    stepper = Careless(vimc4.serial(timeout=1))
    stepper.reference()
    stepper.move_by(800, 0, 0, speed=900)
    is_there(stepper)

def test_of_an_error(vimc4):
    stepper = Careless(vimc4.serial(timeout=1))
    stepper.reference()
    stepper.move_by(800, 0, 0, speed=900)
    if stepper.position() != (800, 0, 0):
        pytest.fail("it is elsewhere")

def test_of_what_it_returns(vimc4):
    stepper = Careless(vimc4.serial(timeout=1))
    stepper.reference()
    assert stepper.move_by(800, 0, 0, speed=900) == "0"

def test_of_what_it_raises(vimc4):
    stepper = Stepper(vimc4.serial(timeout=1))
    stepper.reference()
    stepper.move_by(800, 0, 0, speed=900)
    is_there(stepper)
'''


def test_an_assertion_of_the_test_has_noticed_nothing_for_the_driver(pytester, monkeypatch):
    pytester.makepyfile(ASSERTING)
    drivers = Path(__file__).resolve().parents[2] / "examples" / "python"
    monkeypatch.setenv("PYTHONPATH", str(drivers), prepend=os.pathsep)
    swept = pytester.runpytest_subprocess("-rN")
    swept.assert_outcomes(failed=2, passed=2)
    finding = "only an assertion of the test fails, and the machine is not where it should be (*"
    verdict = "* points, * outcomes, 1 with something wrong"
    swept.stdout.fnmatch_lines(
        [
            "*test_of_the_end_state*",
            finding,
            "  did: *; only an assertion of the test failed",
            verdict,
            "*test_of_an_error*",
            finding,
            verdict,
            "*sweeps of vimc4*",
        ]
    )
    # The verdict stands last, and not before what was logged and printed in all runs.
    swept.stdout.no_fnmatch_line("*Captured*")
    swept.stdout.no_fnmatch_line("*it moves*")


def test_what_no_time_passes_for_is_not_swept(pytester):
    pytester.makepyfile(
        """
        import asyncio
        import pytest

        pytestmark = [pytest.mark.vimc4("imc-s8"), pytest.mark.vimc4_sweep(harms=["dropped"])]

        async def test_async(vimc4):
            await vimc4.aio.now()

        def test_awaits(vimc4):
            asyncio.run(vimc4.aio.run_until_idle())

        @pytest.mark.vimc4(pty=True)
        def test_pty(vimc4):
            assert open(vimc4.port)

        def test_tcp(vimc4_start):
            vimc4_start(tcp="127.0.0.1:0")
        """
    )
    swept = pytester.runpytest_subprocess("-rN")
    swept.assert_outcomes(errors=4)
    swept.stdout.fnmatch_lines(
        [
            "*ERROR at setup of test_async*",
            "it cannot be swept: it awaits its controller, *; sweep a test or a driver without `async`",
            "*ERROR at setup of test_awaits*",
            "it cannot be swept: it awaits its controller, *",
            "*ERROR at setup of test_pty*",
            "it cannot be swept: it opens the controller over a pseudo-terminal, *`vimc4 sweep -- COMMAND`",
            "*ERROR at setup of test_tcp*",
            "it cannot be swept: it opens the controller over TCP, *",
        ]
    )


def test_what_cannot_be_swept_is_no_known_finding(pytester):
    pytester.makepyfile(
        """
        import pytest

        pytestmark = [pytest.mark.xfail(reason="known"), pytest.mark.vimc4("imc-s8")]
        swept = pytest.mark.vimc4_sweep(harms=["dropped"], modes=["transient"])

        @pytest.fixture(scope="module")
        def runs():
            return []

        def careless(vimc4, steps=800):
            port = vimc4.serial(timeout=1)
            for line in (b"@07", b"@0A%d,900,0,900,0,900,0,900" % steps):
                port.write(line + b"\\r")
                port.read(1)

        @pytest.mark.vimc4_sweep(foo=1)
        def test_misspelt(vimc4):
            careless(vimc4)

        @swept
        def test_silent(vimc4):
            pass

        @swept
        def test_with_a_memory(vimc4, runs):
            runs.append(1)
            careless(vimc4, len(runs))

        @swept
        def test_several(vimc4_start):
            vimc4_start()
            vimc4_start()

        @pytest.mark.vimc4_sweep(limit=1e-6)
        def test_in_no_time(vimc4):
            careless(vimc4)

        @pytest.mark.xfail(run=False)
        @pytest.mark.vimc4_sweep(harms="drop")
        def test_never_run(vimc4):
            pass

        @swept
        def test_finding(vimc4):
            careless(vimc4)

        @swept
        def test_broken(vimc4):
            assert False
        """
    )
    swept = pytester.runpytest_subprocess()
    swept.assert_outcomes(errors=6, xfailed=2)
    swept.stdout.fnmatch_lines(
        [
            "*ERROR at setup of test_misspelt*",
            "it cannot be swept: the marker vimc4_sweep has no option `foo`; it has harms, modes, limit",
            "*ERROR at setup of test_silent*",
            "it cannot be swept: there is no point at which this could go wrong*",
            "*ERROR at setup of test_with_a_memory*",
            "it cannot be swept: it does something else each time it runs*",
            "*ERROR at setup of test_several*",
            "it cannot be swept: a test with several controllers cannot be swept; leave it out",
            "*ERROR at setup of test_in_no_time*",
            "it cannot be swept: it has not ended after 1e-06 s although nothing is broken; give a greater limit, or none",
            "*ERROR at setup of test_never_run*",
            "it cannot be swept: `drop` is none of the harms*",
        ]
    )


def test_a_test_that_cannot_be_swept_says_why(pytester):
    pytester.makepyfile(
        """
        import threading, time
        import pytest

        pytestmark = pytest.mark.vimc4_sweep(harms=["dropped"], modes=["transient"], limit=0.3)

        def test_silent(vimc4):
            pass

        def test_several(vimc4, vimc4_start):
            vimc4_start()

        @pytest.mark.vimc4_sweep(harms=["drop"])
        def test_misspelt(vimc4):
            pass

        def test_that_fails_anyway(vimc4):
            assert vimc4.serial(timeout=1).read() == b"0"

        def test_that_hangs(vimc4):
            port = vimc4.serial(timeout=1)
            port.write(b"@07\\r")
            if port.read() != b"0":
                time.sleep(10_000)
        """
    )
    swept = pytester.runpytest_subprocess()
    swept.assert_outcomes(failed=2, errors=3)
    swept.stdout.fnmatch_lines(
        [
            "*it cannot be swept: there is no point at which this could go wrong*",
            "it cannot be swept: a test with several controllers cannot be swept; leave it out",
            "*it cannot be swept: `drop` is none of the harms; they are dropped,*",
            "*AssertionError*",
            "it hangs (*",
        ]
    )
