"""What a driver has to do, said in sentences, and what goes wrong on its way."""

import asyncio
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
import vimc4 as virtual
from stepper import Stepper, StepperError

MOVE = b"@07\r@0A800,300,0,300,0,300,0,300\r"


@pytest.mark.vimc4(machine="mill")
def test_the_spindle_turns_before_the_first_cut(vimc4):
    stepper = Stepper(vimc4.serial())
    stepper.reference()

    # From now on: each of these fails in the moment in which that is clear.
    vimc4.expect().command("@B").once().then().command("@A").answered("0").at_least(2).watch()
    vimc4.expect().never("z < -20mm or z < 0mm and x < 5mm").watch()
    cut = vimc4.expect().whenever("z < 0mm")
    cut.must_have_been("port 2 bit 0 on").for_at_least("500ms").watch()

    stepper.spindle(True)
    stepper.move_by(800, 0, 0, speed=900)
    stepper.move_by(0, 0, -500, speed=900)


@pytest.mark.vimc4(machine="mill")
def test_what_happened_is_asked_afterwards(vimc4):
    stepper = Stepper(vimc4.serial())
    with pytest.raises(StepperError, match="'2'"):
        stepper.move_by(30_000, 0, 0, speed=4_000)

    vimc4.expect().command("@A").refused_with("2").once().so_far()
    vimc4.expect().command("@R").never().so_far()

    # Each motion has its box, and the number of the command that it belongs to.
    journal = vimc4.journal()
    move = journal.moves()[-1]
    assert (move.start[0], move.end[0]) == (0, 20_001)
    events = [entry["event"] for entry in journal.of(move.command)]
    assert events == ["command", "moves", "switch", "warning", "halts", "answer"]


@pytest.mark.vimc4(machine="mill", time="manual")
def test_a_move_stays_inside(vimc4):
    stepper = Stepper(vimc4.serial())
    with vimc4.expect().never("x > 5mm").watch():
        stepper.start_move_by(400, 0, 0, speed=300)
        vimc4.run_until_idle()
        stepper.wait()


@pytest.mark.vimc4(machine="mill")
def test_what_is_not_met_says_what_came_closest(vimc4, root):
    stepper = Stepper(vimc4.serial())
    with pytest.raises(StepperError, match="'2'"):
        stepper.move_by(30_000, 0, 0, speed=4_000)
    with pytest.raises(virtual.Unmet) as unmet:
        vimc4.expect().command("@A").answered("0").once().so_far()
    # The words are those of Rust.
    assert str(unmet.value) == (root / "examples/rust/tests/unmet.txt").read_text().rstrip()
    assert isinstance(unmet.value, AssertionError) and unmet.value.reason == "missing"
    assert unmet.value.but == "it never came" and len(unmet.value.closest) == 1
    again = pickle.loads(pickle.dumps(unmet.value))
    assert (str(again), again.around) == (str(unmet.value), unmet.value.around)


@pytest.mark.parametrize(
    "says, kind, what",
    [
        (lambda e: e.comand("@A"), AttributeError, "`comand` here; it does with command, never, when"),
        (lambda e: e.command("@A").watch(), AttributeError, "`watch` here; it does with answered, at_"),
        (lambda e: e.command("@A").then(), AttributeError, "`then` here"),
        (lambda e: e.whenever("x > 1").once(), AttributeError, "does with must_be, must_follow"),
        (lambda e: e.once, AttributeError, "`once` here"),
        (lambda e: e.command(b"@A"), TypeError, 'not as bytes; say "@A"'),
        (lambda e: e.command("@A").answered(0), TypeError, "not as int"),
        (lambda e: e.command("@A").times("2"), TypeError, "whole number, not as str"),
        (lambda e: e.command("@A").times(True), TypeError, "not as bool"),
        (lambda e: e.command("@A").times(2.0), TypeError, "not as float"),
        (lambda e: e.command("@A").within(5), TypeError, "250ms"),
        (lambda e: bool(e.command("@A").once()), TypeError, "neither true nor false"),
        (lambda e: bool(e), TypeError, "neither true nor false"),
        (lambda e: e.command("@A").times(-1), ValueError, "nothing comes -1 times"),
        (lambda e: e.command("@A").within("5"), ValueError, "has no unit of time"),
        (lambda e: e.command("@Q"), virtual.Mistake, "`command @Q` is wrong at `@Q`"),
        (lambda e: e.never("b < 3"), virtual.Mistake, "`b < 3` is wrong"),
        (lambda e: e.when("x < 1 and x > 1"), virtual.Mistake, "no place is both"),
        (lambda e: e.command("@A").at_least(0), virtual.Mistake, "always so"),
        (lambda e: e.command("@A").refused_with("Q"), virtual.Mistake, "`Q`"),
        (lambda e: e.never("x > 1").if_at_all(), virtual.Mistake, "at_most"),
        (lambda e: e.whenever("x > 1").must_be("z = 0").and_(), virtual.Mistake, "is whole"),
        (lambda e: e.whenever("x > 1").must_have_been("command @A"), virtual.Mistake, "no time"),
        (lambda e: e.never("port 0 bit 7 on").watch(), virtual.Mistake, "neither an output"),
        (lambda e: e.never("port 0 bit 7 on").so_far(), virtual.Mistake, "neither an output"),
    ],
)
def test_mistakes_are_errors_at_once(vimc4, says, kind, what):
    sentence = vimc4.expect()
    with pytest.raises(kind) as error:
        says(sentence)
    assert what in str(error.value)
    assert issubclass(virtual.Mistake, ValueError)


@pytest.mark.vimc4(machine="mill", time="manual")
def test_every_word_is_there(vimc4):
    port = vimc4.connect()
    port.write(MOVE + b"@0P\r")
    vimc4.run_until_idle()
    for sentence in (
        vimc4.expect().command("A").answered("0").within("10s").once().and_().command("@P").at_most(1),
        vimc4.expect().command("@0A800").times(1).then_within(timedelta(seconds=9)).command("@P").once(),
        vimc4.expect().command("@A").once().then_after("1s").command("@P").once(),
        vimc4.expect().command("@R").never().then().when("x = 800").once(),
        vimc4.expect().when("x < -1").never(),
        vimc4.expect().when("x > 3").at_least(1).and_().when("x > 5mm").times(1),
        vimc4.expect().when("x > 3").at_most(2),
        vimc4.expect().whenever("command @A").must_follow("answered @A").within("10s"),
        vimc4.expect().whenever("command @A").must_follow_command("@P").within("10s"),
        vimc4.expect().whenever("x > 700").must_be("y = 0"),
        vimc4.expect().whenever("command @R").must_be("y = 0").if_at_all(),
    ):
        sentence.so_far()
    for sentence in (
        vimc4.expect().command("@A").refused().at_least(1),
        vimc4.expect().whenever("x = 800").must_have_been("x = 800").for_at_least("1s"),
    ):
        with pytest.raises(virtual.Unmet):
            sentence.so_far()


@pytest.mark.vimc4(machine="mill", time="manual")
def test_it_fails_where_the_test_is_and_once(vimc4):
    port = vimc4.connect()
    port.write(MOVE)
    inside = vimc4.expect().never("x > 5mm").watch()
    assert vimc4.run_until("x = 400") and inside.failure is None
    with pytest.raises(virtual.Unmet, match="expected x > 400, never") as raised:
        vimc4.run_until("x = 800")
    # It is told once; then everything is as ever, and the expectation has failed.
    assert vimc4.run_until("x = 800") > raised.value.at
    failure = inside.failure
    assert failure is not None and str(failure) == str(raised.value)
    with pytest.raises(virtual.Unmet):
        inside.check()
    assert str(inside.failure) == str(failure)


def reading(port):
    assert port.read(3) == b"000"


def polling(port):
    while True:
        port.in_waiting


def writing(port):
    while True:
        port.write(b"@0P\r")
        port.reset_input_buffer()


@pytest.mark.parametrize("waits", [reading, polling, writing])
@pytest.mark.parametrize("kind", ["connect", "serial"])
@pytest.mark.vimc4(machine="mill", time="20x")
def test_who_reads_from_the_line_learns_of_it_at_once(vimc4, kind, waits):
    port = getattr(vimc4, kind)(timeout=None)
    port.write(MOVE)
    watched = vimc4.expect().never("x > 5mm").watch()
    # Two answers come, and a third never would.
    with pytest.raises(virtual.Unmet, match="expected x > 400, never"):
        waits(port)
    watched.give_up()


@pytest.mark.vimc4(machine="mill", time="20x")
def test_a_driver_in_another_thread_is_left_alone(vimc4):
    with vimc4.serial(timeout=60) as port, ThreadPoolExecutor() as pool:
        stepper = Stepper(port)
        watched = vimc4.expect().never("x > 5mm").watch()
        driver = pool.submit(stepper.move_by, 800, 0, 0, 300)
        with pytest.raises(virtual.Unmet):
            vimc4.until_paused(timeout=60)
        driver.result()
        watched.give_up()


@pytest.mark.vimc4(machine="mill", time="manual")
def test_what_waits_for_nothing_is_ended(vimc4):
    # A driver of another process would learn of it the same way.
    port = vimc4.connect(timeout=60)
    got = []
    driver = threading.Thread(target=lambda: got.append(port.read(99)))
    driver.start()
    watched = vimc4.expect().command("@V").never().watch().or_stop()
    vimc4.connect().write(b"@07\r@0V\r")
    driver.join(60)
    assert not driver.is_alive()
    with pytest.raises(virtual.Unmet):
        watched.check()


def test_it_is_waited_for(vimc4):
    port = vimc4.connect()
    met = vimc4.expect().command("@P").at_least(1).watch()
    never = vimc4.expect().command("@V").never().watch()
    with pytest.raises(virtual.Late):
        met.wait_until_met(timeout=0.01)
    port.write(b"@07\r@0P\r")
    met.wait_until_met()
    met.check()
    never.wait_until_met()
    port.write(b"@0V\r")
    with pytest.raises(virtual.Unmet):
        never.check()
    with pytest.raises(ValueError, match="not expected any more"):
        never.met()
    with pytest.raises(TypeError, match="neither true nor false"):
        assert met


def test_tasks_learn_of_it_too():
    async def main():
        with virtual.Emulator(machine="mill", time="20x") as emulator:
            met = emulator.expect().command("@A").once().watch()
            inside = emulator.expect().never("x > 5mm").watch()
            emulator.connect().write(MOVE)
            await met.met()
            with pytest.raises(virtual.Unmet, match="x > 400"):
                await emulator.aio.until_paused()
            assert inside.failure is not None
            inside.give_up()
            assert await emulator.aio.faults() == []

    asyncio.run(asyncio.wait_for(main(), 60))


def test_the_recording_ends_where_it_fails(tmp_path):
    file = tmp_path / "session.jsonl"
    with pytest.raises(virtual.Unmet):
        with virtual.Emulator(machine="mill", time="manual", record_failure=file) as emulator:
            emulator.expect().never("x > 5mm").watch()
            port = emulator.connect()
            port.write(MOVE)
            emulator.run_until_idle()
            port.write(b"@0P\r")
    end, mark = file.read_text().splitlines()[:-3:-1]
    assert '"end":"an expectation was not met"' in end
    assert '"mark":"expected x > 400, never, but it came at ' in mark
    assert "@0P" not in file.read_text()


def test_what_nobody_checks_is_checked_at_the_end(tmp_path):
    emulator = virtual.Emulator(time="instant", record_failure=tmp_path / "stays.jsonl")
    emulator.expect().command("@A").once().watch()
    with pytest.raises(virtual.Unmet, match="expected command @A, once\n  but it never came"):
        emulator.close()
    assert emulator.closed and (tmp_path / "stays.jsonl").exists()
    with virtual.Emulator(time="instant") as emulator:
        emulator.expect().command("@A").once().watch()
        with pytest.raises(virtual.Unmet):
            emulator.check()
        emulator.check()
        emulator.expect().command("@A").once()
        with pytest.raises(virtual.Unfinished, match=r"begins at .*test_expectations.py:\d+ has no end"):
            emulator.check()


def test_an_error_takes_with_it_what_was_expected(capsys):
    with pytest.raises(ZeroDivisionError) as error:
        with virtual.Emulator(time="instant") as emulator:
            emulator.expect().command("@A").once().watch()
            with emulator.expect().command("@B").once().watch():
                raise ZeroDivisionError
    notes = "".join(getattr(error.value, "__notes__", [])) or capsys.readouterr().err
    assert "expected command @A, once" in notes and "expected command @B, once" in notes


def test_without_a_record_it_is_watched_all_the_same():
    with virtual.Emulator(time="instant", record=False) as emulator:
        watched = emulator.expect().command("@P").once().watch()
        emulator.connect().write(b"@0P\r")
        watched.check()
        with pytest.raises(virtual.ControlError, match="record=False"):
            emulator.expect().command("@P").once().so_far()
        assert len(emulator.journal()) == 0
    with pytest.raises(virtual.Ended):
        emulator.expect().command("@P").once().watch()
    emulator.check()


@pytest.mark.vimc4(machine="mill")
def test_the_journal_is_a_sequence(vimc4):
    port = vimc4.connect()
    port.write(MOVE)
    # Where the axis has stopped before the cover is opened, whoever is faster.
    assert port.read(2) == b"00"
    vimc4.order("cover open")
    journal = vimc4.journal()
    assert len(journal) == len(list(journal)) > 4 and journal.dropped == 0
    assert journal[0]["event"] == "command" and journal[0]["bytes"] == "@07"
    assert [entry["number"] for entry in journal[:2]] == [1, 2]
    assert [
        {key: value for key, value in entry.items() if key not in ("number", "at")}
        for entry in journal[-2:]
    ] == [
        {"event": "deed", "by": "the library", "what": "cover open"},
        {"event": "signal", "signal": "cover", "value": 0},
    ]
    moves = journal.moves()
    assert moves[0].low == [0, 0, 0, 0] and moves[0].high[0] == moves[0].end[0] == 800
    halts = next(entry for entry in journal if entry["event"] == "halts")
    assert halts["high"] == {"X": 800} and halts["command"] == moves[0].command
    assert str(journal).splitlines() == journal.story() and "moves X from 0 to 800" in str(journal)
    assert journal.json_lines().count("\n") == len(journal)
    assert repr(journal) == f"<vimc4.Journal of {len(journal)} entries>"
    vimc4.forget()
    assert list(vimc4.journal()) == []


# --- what goes wrong ---


def test_a_fault_ends_with_its_block(vimc4):
    port = vimc4.serial(timeout=0.05)
    with vimc4.fault("drop to-host once") as fault:
        port.write(b"@07\r")
        assert port.read() == b""
        assert fault.struck == 1 and fault.is_over
    port.write(b"@07\r")
    assert port.read() == b"0"
    assert fault.struck == 1 and vimc4.faults() == []


def test_a_lost_answer_is_noticed(vimc4):
    stepper = Stepper(vimc4.serial(timeout=0.05))
    with vimc4.fault("drop to-host after @0A"):
        with pytest.raises(StepperError, match="is it switched on"):
            stepper.move_by(100, 0, 0, speed=900)
    # The move was made all the same.
    assert stepper.position() == (100, 0, 0)


def test_faults_have_numbers_and_stages(vimc4):
    cut = vimc4.fault("cut to-host")
    waits = vimc4.fault("jam x after x > 50")
    assert (cut.number, waits.number) == (1, 2)
    assert repr(waits) == "<vimc4.Fault 2: jam x after x > 50>"
    assert vimc4.faults() == [
        (1, "cut to-host", "strikes", 0), (2, "jam x after x > 50", "waits", 0),
    ]  # fmt: skip
    assert cut.view().stage == "strikes" and not cut.is_over and cut.struck == 0
    cut.end()
    cut.end()
    assert cut.is_over and [view.number for view in vimc4.faults()] == [2]
    vimc4.order("fault end all")
    assert waits.view() is None and waits.is_over and waits.struck == 0
    vimc4.fault("power-off")
    vimc4.end_faults()
    assert vimc4.faults() == [] and vimc4.view()["powered"]
    with pytest.raises(virtual.FaultError, match="`cut to-hosts` is wrong"):
        vimc4.fault("cut to-hosts")
    assert issubclass(virtual.FaultError, ValueError)


@pytest.mark.vimc4(machine="mill", time="manual")
def test_a_jammed_motor_is_seen_in_the_carriage(vimc4):
    stepper = Stepper(vimc4.serial())
    home = vimc4.view()["axes"][0]["carriage"]
    with vimc4.fault("jam x after x > 50"):
        stepper.start_move_by(100, 0, 0, speed=300)
        vimc4.run_until_idle()
        stepper.wait()
    assert stepper.position() == (100, 0, 0)
    x = vimc4.view()["axes"][0]
    assert x["carriage"] == home + 51


def test_what_has_ended_has_no_faults():
    with virtual.Emulator(time="instant") as emulator:
        fault = emulator.fault("cut")
        emulator.stop()
        emulator.ended(timeout=60)
        fault.end()
    assert fault.is_over
