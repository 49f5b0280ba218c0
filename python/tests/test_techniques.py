"""Ways to set up, to watch and to wait."""

import copy
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
import serial
import vimc4 as virtual
from stepper import Stepper, StepperError


@pytest.mark.vimc4(model="imc-s8")
def test_ten_minutes_pass_at_once(vimc4):
    stepper = Stepper(vimc4.serial())
    stepper.move_by(600_000, 0, 0, speed=1_000)
    assert vimc4.now() > 600 * 1_000_000_000


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.vimc4(pty=True, tcp="127.0.0.1:0", rfc2217="127.0.0.1:0")
def test_every_kind_of_port_is_the_same_line(vimc4):
    with vimc4.serial() as port:
        stepper = Stepper(port)
        stepper.move_by(-1, 2, -3, speed=900)
    # A pseudo-terminal, sockets, and the same line once more by an address.
    for address in (vimc4.port, vimc4.socket_url, vimc4.rfc2217_url, vimc4.url):
        with serial.serial_for_url(address, 19_200, timeout=10) as port:
            stepper = Stepper(port)
            assert stepper.position() == (-1, 2, -3)


def test_an_address_starts_a_controller():
    with serial.serial_for_url("vimc4://imc-s8?time=instant", 19_200, timeout=10) as port:
        stepper = Stepper(port)
        stepper.move_by(1, 2, 3, speed=900)
        assert port.emulator.position() == [1, 2, 3, 0]


@pytest.mark.vimc4(time="manual", tcp="127.0.0.1:0")
def test_a_command_over_tcp_has_arrived_before_time_moves(vimc4):
    with serial.serial_for_url(vimc4.socket_url, timeout=10) as port:
        stepper = Stepper(port)
        for _ in range(100):
            stepper.start_move_by(10, 0, 0, speed=250)
            vimc4.run_until_idle()
            stepper.wait()


def test_two_hundred_controllers_share_a_thread():
    worker = virtual.Worker("controllers")
    before = threading.active_count()
    emulators = [virtual.Emulator(time="instant", on=worker) for _ in range(200)]
    for number, emulator in enumerate(emulators, 1):
        stepper = Stepper(emulator.serial())
        stepper.move_by(number, 0, 0, speed=900)
        assert stepper.position() == (number, 0, 0)
    assert threading.active_count() == before


@pytest.mark.vimc4(time="manual")
def test_a_driver_that_blocks_runs_in_a_thread(vimc4):
    stepper = Stepper(vimc4.serial())
    with ThreadPoolExecutor() as pool:
        driver = pool.submit(stepper.move_by, 5_000, 0, 0, speed=300)

        # Before the command is there nothing moves, and there is nothing to run until.
        vimc4.next_command("@A")
        vimc4.run_until("x = 2500")
        vimc4.press("stop")
        with pytest.raises(StepperError, match="'F'"):
            driver.result()


@pytest.mark.vimc4(time="8x")
def test_a_breakpoint_holds_the_controller_and_not_the_driver(vimc4):
    below = vimc4.break_when("z < -500")
    stepper = Stepper(vimc4.serial())

    def drive():
        for _ in range(2):
            stepper.move_by(0, 0, -1_000, speed=900)
            stepper.move_by(0, 0, 1_000, speed=900)

    with ThreadPoolExecutor() as pool:
        driver = pool.submit(drive)
        for met in (1, 2):
            assert vimc4.until_paused().breakpoints == [below]
            assert vimc4.position() == [0, 0, -501, 0]
            assert vimc4.breakpoints() == [(below, "z < -500", met)]
            vimc4.resume()
        driver.result()


@pytest.mark.vimc4(time="manual")
def test_time_that_is_paused_is_led_step_by_step(vimc4):
    with pytest.raises(virtual.ControlError, match="pause it first"):
        vimc4.step()
    port = vimc4.serial()
    port.write(b"@07\r")
    assert port.read() == b"0"
    at = vimc4.pause()
    assert vimc4.paused() == (at, "the library", [])
    port.write(b"@0A5,900,0,900,0,900,0,900\r")
    assert vimc4.hear(100) == 27
    steps = 0
    while vimc4.step() == "cause":
        steps += 1
    assert steps > 0 and vimc4.position()[0] == 5
    vimc4.resume()
    assert vimc4.paused() is None


@pytest.mark.vimc4(machine="mill")
def test_lost_steps_are_among_the_events(vimc4):
    stepper = Stepper(vimc4.serial())
    stepper.reference()
    with pytest.raises(StepperError, match="'2'"):
        stepper.move_by(30_000, 0, 0, speed=4_000)

    lost = []
    for event in vimc4.events():
        match event:
            case {"event": "warning", "warning": "steps-lost", "axis": 0, "steps": steps}:
                lost.append(steps)
    x = vimc4.view()["axes"][0]
    assert lost == [x["carriage"] - x["position"]]
    assert not x["referenced"]


@pytest.mark.vimc4(machine="mill")
def test_reports_are_taken_whenever_there_is_time(vimc4):
    reports = vimc4.reports("command", "warning")
    stepper = Stepper(vimc4.serial())
    stepper.reference()
    vimc4.close()
    events = [report["what"]["event"]["event"] for report in reports if "event" in report["what"]]
    assert [event["mnemonic"] for event in events if event["event"] == "command"] == ["@axes", "@R"]


def test_a_stored_program_survives_in_its_file(tmp_path):
    def start():
        return virtual.Emulator(time="instant", flash=tmp_path / "flash")

    with start() as emulator:
        port = emulator.serial()
        for line in (b"@01", b"@0i", b"0100,900", b"9"):
            port.write(line + b"\r")
            assert port.read() == b"0", line

    with start() as emulator:
        emulator.press("start")
        emulator.run_until_idle()
        assert emulator.position() == [100, 0, 0, 0]


def test_a_controller_in_virtual_time():
    imc4 = virtual.Harness("imc4", "mill", watching=["command", "answer"])

    # A question is asked, and the answer is there: here the axes X, Y and Z, and a reference run.
    assert imc4.ask(b"@07\r") == b"0"
    assert imc4.ask(b"@0R7\r") == b"0"

    # Or it is only sent, and time passes as it is told to.
    imc4.give(b"@0A8000,2000,4000,1000,0,1000,0,1000\r")
    imc4.run_until("x = 4000")
    assert imc4.position()[:2] == [4_000, 2_000]

    # In half a second somebody will press STOP, and two seconds later the host goes on.
    there = imc4.copy()
    imc4.plan("500ms", "press stop")
    imc4.plan("2500ms", b"@0S\r")
    imc4.run_to_rest()
    assert imc4.position()[0] == 8_000

    # Everything that has come out is there, in order, each with its time.
    answers = [output["bytes"] for output in imc4.drain() if output.get("event") == "answer"]
    assert answers == [b"0", b"0", b"F", b"0"]

    # The copy stands where it stood, and goes its own way.
    assert there != imc4 and there == there.copy() == copy.copy(there)
    assert there.position()[0] == 4_000
    assert there.run_until("y > 5000") is None


def test_a_running_controller_is_copied_and_put_back(vimc4):
    port = vimc4.serial()
    port.write(b"@07\r")
    assert port.read() == b"0"
    ahead = vimc4.harness()
    assert ahead.ask(b"@0A100,900,0,900,0,900,0,900\r") == b"0"
    assert vimc4.position()[0] == 0
    vimc4.put(ahead)
    assert vimc4.position()[0] == 100
    assert vimc4.now() == ahead.now
    with pytest.raises(virtual.ControlError, match="another family"):
        vimc4.put(virtual.Harness("smcu", "board-plotter"))


def test_orders_are_those_that_people_type(vimc4):
    assert vimc4.order("cover open") == "ok"
    with pytest.raises(virtual.OrderError, match="it can be open or closed"):
        vimc4.order("cover shut")
    assert vimc4.order("position") == "X 0 Y 0 Z 0 A 0, cannot move"
    assert ("press stop", "STOP button") in vimc4.complete("press s")


def test_faults_are_orders(vimc4):
    port = vimc4.serial(timeout=0.05)
    vimc4.order("fault drop to-host once")
    port.write(b"@07\r")
    assert port.read() == b""
    port.write(b"@07\r")
    assert port.read() == b"0"


def test_a_profile_may_be_changed_in_the_program(root):
    text = virtual.machine_profile("mill")
    mine = virtual.Machine(text.replace('name = "mill"', 'name = "my mill"'))
    assert mine.name == "my mill"
    with virtual.Emulator(virtual.Model(virtual.model_profile("imc-s8")), mine) as emulator:
        view = emulator.view()
        assert (view["model"], view["machine"]) == ("imc-s8", "my mill")
    with pytest.raises(virtual.ProfileError, match="imc-s8"):
        virtual.Emulator("imc-s9")
    with virtual.Emulator(root / "examples" / "model.toml") as emulator:
        assert emulator.model not in virtual.models()


def test_a_family_of_its_own_speaks_its_own_language():
    with virtual.Emulator("smcu", "board-plotter", "instant") as emulator:
        port = emulator.serial()
        assert port.baudrate == emulator.baud == 9_600
        port.write(b"!CT1;")
        assert port.read_until(b"\r")
        assert emulator.axis_names[:2] == ["X", "Y"]


@pytest.mark.vimc4(coverage=True)
def test_what_the_driver_has_met_is_counted(vimc4, tmp_path):
    stepper = Stepper(vimc4.serial())
    stepper.move_by(100, 0, 0, speed=900)

    coverage = vimc4.coverage()
    assert coverage.totals()["commands"]["met"] == 2
    assert any("you never met" in sentence and "limit switch" in sentence for sentence in coverage.missing())
    (tmp_path / "coverage.html").write_text(coverage.html())

    # Several runs are added up in a file, which `vimc4 coverage` shows.
    file = tmp_path / "coverage.json"
    assert coverage.add_to(file) == coverage == virtual.Coverage.read(file)
    assert coverage.add_to(file) == coverage + coverage


def test_coverage_is_of_one_model(tmp_path):
    with virtual.Emulator(coverage=True) as one, virtual.Emulator("smcu", coverage=True) as other:
        mine, others = one.coverage(), other.coverage()
    with pytest.raises(virtual.CoverageError, match="it covers the model smcu"):
        mine + others
    with pytest.raises(virtual.CoverageError, match="no coverage"):
        virtual.Coverage.from_json("{}")
    with pytest.raises(virtual.CoverageFileError):
        mine.add_to(tmp_path)
    assert virtual.Coverage.from_json(mine.json()) == mine and mine.model in repr(mine)
    source, tracefile = mine.lcov("tables.txt")
    assert "@A" in source and "SF:tables.txt" in tracefile
    assert "@A" in mine.table() and mine.commands()[0]["mnemonic"]


@pytest.mark.xfail(reason="the driver does not read the position back")
@pytest.mark.vimc4("imc-s8", "mill")
@pytest.mark.vimc4_sweep(modes=["transient"])
def test_the_driver_notices_what_goes_wrong(vimc4):
    stepper = Stepper(vimc4.serial(timeout=1))
    stepper.reference()
    stepper.move_by(800, 0, 0, speed=900)
    assert stepper.position() == (800, 0, 0)
