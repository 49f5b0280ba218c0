"""Every fault that can strike a driver, one after the other."""

import asyncio
import functools
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from time import sleep as sleep

import pytest
import vimc4 as virtual

sys.path.insert(0, str(Path(__file__).parent))

from stepper import Stepper, StepperError
from sweeping import assertive, careful, careless, patient


def test_a_careful_driver_is_wrong_only_where_no_answer_tells():
    swept = virtual.sweep(careful, "imc-s8", "mill")
    assert swept.points > 500
    assert sum(outcome.points for outcome in swept.outcomes) == swept.points
    assert {outcome.heard for outcome in swept.bad} == {"what it always hears"}
    told = virtual.sweep(careful, "imc-s8", "mill", harms=["garbled", "duplicated"])
    told.check()


def test_a_careless_driver_is_found_out():
    swept = virtual.sweep(careless, "imc-s8", "mill")
    with pytest.raises(AssertionError, match="it reports success, but the machine is not where it"):
        swept.check()
    worst = swept.bad[0]
    assert worst.bad and worst.should and str(worst) in str(swept)
    assert any("as the answer to" in outcome.heard for outcome in swept.bad)
    # Once more, as for a debugger.
    swept.again(worst.point)


def test_who_waits_for_ever_hangs():
    swept = virtual.sweep(patient, "imc-s8", "mill", harms=["dropped"], modes=["transient"])
    worst = swept.bad[0]
    assert worst.title == "it hangs" and "wait for a limited time" in worst.should


def endless(emulator):
    """It asks until it gets an answer, and looks at no clock."""
    port = emulator.serial(timeout=1)
    for line in (b"@07\r", b"@0P\r"):
        answer = b""
        while not answer:
            port.write(line)
            answer = port.read(1)


def test_who_goes_round_and_round_is_ended():
    swept = virtual.sweep(
        endless, "imc-s8", harms=["power-off"], modes=["persistent"], limit=0.3
    )
    assert [outcome.title for outcome in swept.bad] == ["it hangs"]


def asserting(emulator, move=careless):
    """It leaves it to the assertion of a test to find out where the axis is."""
    move(emulator)
    assert Stepper(emulator.serial(timeout=1)).position() == (800, 0, 0)


def asserting_the_answer(emulator):
    """It has no driver: the test itself looks at each answer."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.start_move_by(800, 0, 0, speed=900)
    assert stepper.port.read(1) == b"0"


def test_an_assertion_about_the_end_state_has_noticed_nothing_for_the_driver():
    options = {"model": "imc-s8", "machine": "mill", "modes": ["transient"]}
    swept = virtual.sweep(asserting, **options, harms=["stop"])
    titles = {outcome.title for outcome in swept.bad}
    assert titles == {"only an assertion of the test fails, and the machine is not where it should be"}
    assert all("only an assertion of the test failed" in outcome.did for outcome in swept.bad)
    assert any("stopped by STOP" in outcome.should for outcome in swept.bad)
    # What no answer tells is no less a finding.
    silent = virtual.sweep(functools.partial(asserting, move=assertive), **options, harms=["misread"])
    assert any("no answer tells it" in outcome.should or "another answer" in outcome.heard for outcome in silent.bad)
    # A driver may assert what it is answered, and a test may stand in for a driver.
    for noticing in (assertive, asserting_the_answer, functools.partial(asserting, move=assertive)):
        virtual.sweep(noticing, **options, harms=["stop"]).check()


def awaiting(emulator):
    """It awaits time, which only reading lets pass."""
    emulator.connect().write(b"@07\r")
    asyncio.run(emulator.aio.run_until_idle())


def polling(emulator):
    """It looks whether there is an answer, and takes what is there."""
    port = emulator.connect()
    for line in (b"@07\r", b"@0R7\r", b"@0A800,900,0,900,0,900,0,900\r"):
        port.write(line)
        for _ in range(3):
            if port.in_waiting:
                assert port.read(port.in_waiting) == b"0"
                break
        else:
            raise TimeoutError


def test_a_driver_may_look_whether_there_is_something():
    one, other = (virtual.sweep(polling, "imc-s8", "mill", modes=["transient"]) for _ in range(2))
    assert one.lines() == other.lines() and one.points > 100


def broken(emulator):
    raise ValueError("it never works")


def test_a_driver_that_fails_by_itself_is_told_so():
    with pytest.raises(virtual.Error, match="although nothing is broken; mend that first"):
        virtual.sweep(broken)
    with pytest.raises(ValueError, match="3/2 is no part"):
        virtual.sweep(careful, shard=(3, 2))


def sleeping(emulator):
    """It waits for something else than its port."""
    port = emulator.serial(timeout=1)
    port.write(b"@07\r")
    if port.read(1) != b"0":
        threading.Event().wait()


def test_who_waits_elsewhere_hangs_and_is_left_behind():
    swept = virtual.sweep(
        sleeping, "imc-s8", harms=["dropped"], modes=["transient"], limit=0.2
    )
    assert {outcome.title for outcome in swept.bad} == {"it hangs"}


async def awaited(emulator):
    emulator.serial(timeout=1).write(b"@07\r")


class Awaited:
    async def __call__(self, emulator):
        await awaited(emulator)


@pytest.mark.parametrize(
    ("drive", "options", "error", "says"),
    [
        (lambda emulator: None, {}, virtual.Error, "the driver has to send something"),
        (lambda emulator: emulator.advance("1s"), {}, virtual.Error, "has to send something"),
        (awaited, {}, TypeError, "be done when it returns"),
        (Awaited(), {}, TypeError, "be done when it returns"),
        (functools.partial(awaited), {}, TypeError, "be done when it returns"),
        (lambda emulator: (yield), {}, TypeError, "be done when it returns"),
        (awaiting, {}, virtual.Error, "it awaits its controller, and in a sweep time passes only while"),
        (3, {}, TypeError, "3 cannot be called"),
        (broken, {}, virtual.Error, "it never works"),
        (careful, {"harms": []}, ValueError, "there are no harms to try"),
        (careful, {"modes": []}, ValueError, "there are no modes to try"),
        (careful, {"harms": "drop"}, ValueError, "`drop` is none of the harms; they are dropped"),
        (careful, {"modes": ["often"]}, ValueError, "`often` is none of the modes"),
        (careful, {"shard": "1/3"}, ValueError, "'1/3' is no part; the first"),
        (careful, {"shard": (1.5, 3)}, ValueError, r"\(1.5, 3\) is no part; the first"),
        (careful, {"shard": (True, 3)}, ValueError, r"\(True, 3\) is no part; the first"),
        (
            careful,
            {"limit": 1e-9, "model": "imc-s8", "machine": "mill"},
            virtual.Error,
            "the driver has not ended after 1e-09 s although nothing is broken; give a greater limit, or none",
        ),
        (careful, {"limit": 0}, ValueError, "0 is no limit; give a finite number of seconds above 0"),
        (careful, {"limit": -1}, ValueError, "-1 is no limit"),
        (careful, {"limit": float("inf")}, ValueError, "inf is no limit"),
        (careful, {"limit": float("nan")}, ValueError, "nan is no limit"),
        (careful, {"limit": "3s"}, TypeError, "'3s' is no limit; give a number of seconds"),
        (careful, {"executor": 3}, TypeError, "3 is no executor"),
        (careful, {"known": "junk\n"}, ValueError, "`known` is not from this sweep: line 1"),
    ],
)
def test_what_cannot_be_swept_is_refused(drive, options, error, says):
    with pytest.raises(error, match=says):
        virtual.sweep(drive, **options)


def test_there_is_no_point_before_the_first():
    swept = virtual.sweep(careless, "imc-s8", "mill", harms=["stop"])
    for point in (-1, swept.points):
        with pytest.raises(ValueError, match=f"there is no point {point}; there are"):
            swept.again(point)
    for point in ("1", 1.0, True, None):
        with pytest.raises(TypeError, match=f"^{point!r} is no point; give the number of one, from 0 on"):
            swept.again(point)
    told = f"<vimc4.Sweep of sweeping.careless: {swept.points} points, {len(swept.outcomes)} outcomes, "
    assert repr(swept).startswith(told)


def test_one_harm_may_be_said_without_a_list():
    options = {"model": "imc-s8", "modes": "transient"}
    alone, listed = (virtual.sweep(careful, **options, harms=harms) for harms in ("stop", ["stop"]))
    assert alone.lines() == listed.lines()


def moving(emulator, steps=800):
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.move_by(steps, 0, 0, speed=900)


OF_MOVING = {"drive": moving, "model": "imc-s8", "machine": "mill", "harms": ["dropped"], "modes": ["transient"]}


@pytest.mark.parametrize(
    ("other", "says"),
    [
        ({"harms": ["garbled"]}, "the harms are `garbled` there and `dropped` here"),
        ({"modes": ["persistent"]}, "the modes are `persistent` there and `transient` here"),
        ({"model": "imc4"}, "the model is `imc4` there and `imc-s8` here"),
        ({"machine": "bench"}, "the machine is `bench` there and `mill` here"),
        ({"drive": careless}, "what is swept is `sweeping.careless` there and `test_sweep.moving` here"),
        (
            {"drive": functools.partial(moving, steps=400)},
            r"what is swept is `test_sweep.moving\(steps=400\)` there and `test_sweep.moving` here",
        ),
    ],
    ids=lambda value: None if isinstance(value, dict) else value.split()[1],
)
def test_what_is_known_of_another_sweep_is_refused(other, says):
    known = virtual.sweep(**{**OF_MOVING, **other}, shard=(1, 8)).lines()
    with pytest.raises(ValueError, match=f"`known` is not from this sweep: line 1: .*{says}"):
        virtual.sweep(**OF_MOVING, known=known)
    # Nor is what does not say of what it is.
    with pytest.raises(ValueError, match="line 1: it does not say which sweep"):
        virtual.sweep(**OF_MOVING, known=known.partition("\n")[2])


def driving(emulator, looks):
    """What it sends is the same, whether it looks at the answer of its move or not."""
    (moving if looks else careless)(emulator)


class Configured:
    """A driver that is an object, with attributes."""

    def __init__(self, looks):
        self.looks = looks

    def run(self, emulator):
        driving(emulator, self.looks)

    __call__ = run

    @classmethod
    def usual(cls, emulator):
        driving(emulator, True)


class Inheriting(Configured):
    pass


class Slotted:
    __slots__ = ("looks",)

    def __init__(self, looks):
        self.looks = looks

    def __call__(self, emulator):
        driving(emulator, self.looks)


def closing_over(looks):
    return lambda emulator: driving(emulator, looks)


def by_default(looks):
    def drive(emulator, looks=looks):
        driving(emulator, looks)

    return drive


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (Configured, r"Configured\(looks=False\)` there and .*Configured\(looks=True\)` here"),
        (lambda looks: Configured(looks).run, r"Configured.run of test_sweep.Configured\(looks=False\)` there"),
        (lambda looks: (Configured, Inheriting)[looks].usual, "of test_sweep.Configured` there and .*Inheriting` here"),
        (Slotted, r"Slotted\(looks=False\)` there"),
        (closing_over, r"closing_over.<locals>.<lambda> in line \d+\(looks=False\)` there"),
        (by_default, r"by_default.<locals>.drive\(looks=False\)` there"),
        (lambda looks: functools.partial(Configured(looks).run), r"looks=False\)\(\)` there"),
    ],
    ids=["object", "bound", "class", "slots", "closure", "defaults", "partial"],
)
def test_drivers_of_one_name_are_told_apart_by_what_they_carry(make, says):
    options = {"model": "imc-s8", "machine": "mill", "harms": ["dropped"], "modes": ["transient"], "shard": (1, 20)}
    known = virtual.sweep(make(False), **options).lines()
    assert virtual.sweep(make(False), **options, known=known).lines() == known
    with pytest.raises(ValueError, match=says):
        virtual.sweep(make(True), **options, known=known)


def test_a_driver_has_one_name_in_every_process():
    told = {
        subprocess.run(
            [sys.executable, "-c", NAMES], env={**os.environ, "PYTHONHASHSEED": seed}, check=True, capture_output=True, timeout=60
        ).stdout
        for seed in ("1", "2")
    }
    assert len(told) == 1
    name, long, same = told.pop().decode().splitlines()
    assert name == (
        "__main__.Driver(ways={'x', 'y', 'z'}, at=datetime.timedelta(0, 1, 0), here=__main__.Driver.go of …, "
        "more=[{1: [None]}, collections.OrderedDict({2: b'3'}), __main__.free, re._compile('x', 32), "
        "__main__.Stated(state=['one', 'other'])])"
    )
    assert len(long) < 300 and long != same


NAMES = """
import collections, datetime, re
from vimc4._named import named

def free(): pass

class Stated:
    def __getstate__(self): return ("one", "other")

class Driver:
    def __init__(self):
        self.ways = {"x", "y", "z"}
        self.at = datetime.timedelta(seconds=1)
        self.here = self.go
        self.more = [{1: (None,)}, collections.OrderedDict({2: b"3"}), free, re.compile("x"), Stated()]

    def go(self): pass
    __call__ = go

def of(value):
    return lambda emulator: value

print(named(Driver()).text)
for last in "ab":
    print(named(of("long" * 1000 + last)).text)
"""


def test_a_driver_of_which_nothing_can_be_said_knows_nothing():
    lock = threading.Lock()

    def locked(emulator):
        with lock:
            moving(emulator)

    known = virtual.sweep(locked, "imc-s8", "mill", harms=["dropped"], shard=(1, 50)).lines()
    with pytest.raises(ValueError, match="`known` may be from another driver: .* class _thread.lock that test_sweep"):
        virtual.sweep(locked, "imc-s8", "mill", harms=["dropped"], known=known)


def expecting(emulator):
    """What it expects is that nothing goes wrong."""
    emulator.expect().command("@A").answered("0").once().watch()
    careless(emulator)


def closing(emulator):
    """It cleans up behind itself."""
    careless(emulator)
    emulator.close()


def both(emulator):
    """What goes wrong is an expectation, and is told as the emulator ends."""
    expecting(emulator)
    emulator.close()


def unwatched(emulator):
    """It fails by itself, and leaves an expectation behind."""
    emulator.expect().command("@A").answered("0").once().watch()
    moving(emulator)


@pytest.mark.parametrize("drive", [expecting, both, unwatched])
def test_an_expectation_that_is_not_met_is_an_error_of_the_driver(drive):
    swept = virtual.sweep(drive, "imc-s8", "mill", harms=["stop", "dropped"], modes=["transient"])
    assert sum(outcome.points for outcome in swept.outcomes) == swept.points
    assert any(outcome.did.endswith("it raised an error") for outcome in swept.outcomes)
    # What goes wrong in the answer of the move is noticed.
    assert not any("@#A" in outcome.heard for outcome in swept.bad)


def test_a_driver_may_close_its_emulator():
    options = {"model": "imc-s8", "machine": "mill", "harms": ["stop"], "modes": ["transient"]}
    swept, like = virtual.sweep(closing, **options), virtual.sweep(careless, **options)
    assert swept.bad and [str(one) for one in swept.bad] == [str(one) for one in like.bad]


def test_a_driver_that_does_something_else_each_time_is_refused():
    steps = iter(range(100, 10_000))
    with pytest.raises(virtual.Error) as raised:
        virtual.sweep(lambda emulator: moving(emulator, next(steps)), "imc-s8", "mill")
    told = str(raised.value)
    assert "first it sent `@0A100,900" in told and "then it sent `@0A101,900" in told


def test_shards_are_put_together_and_interrupted_ones_go_on():
    options = {"model": "imc-s8", "machine": "mill", "harms": ["dropped", "stop"]}
    whole = virtual.sweep(careless, **options)
    steps = []
    known = ""
    for number in (1, 2, 3):
        done = virtual.sweep(
            careless, **options, shard=(number, 3), known=known,
            progress=lambda done, total: steps.append((done, total)),
        )  # fmt: skip
        known = done.lines()
    assert known == whole.lines() and len(known.splitlines()) > whole.points
    # Each point was tried once.
    assert sum(total for done, total in steps if done == total) == whole.points
    again = virtual.sweep(careless, **options, known=known, progress=lambda *_: pytest.fail("nothing"))
    assert again.lines() == known


@pytest.mark.parametrize(
    "executor",
    [
        lambda: ThreadPoolExecutor(4),
        lambda: ProcessPoolExecutor(2, mp_context=get_context("spawn")),
    ],
    ids=["threads", "processes"],
)
def test_the_results_are_equal_whoever_does_the_work(executor):
    options = {"model": "imc-s8", "machine": "mill"}
    alone = virtual.sweep(careless, **options).lines()
    with executor() as workers:
        assert virtual.sweep(careless, **options, executor=workers).lines() == alone


@pytest.mark.filterwarnings("ignore")
def test_the_workers_may_be_those_of_dask(tmp_path):
    distributed = pytest.importorskip("distributed")
    options = {"model": "imc-s8", "machine": "mill"}
    alone = virtual.sweep(careless, **options).lines()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        local_directory=tmp_path,
    ) as cluster, distributed.Client(cluster) as client:  # fmt: skip
        client.run(sys.path.insert, 0, str(Path(__file__).parent))
        swept = virtual.sweep(careless, **options, executor=client.get_executor())
        assert len(client.scheduler_info()["workers"]) == 2
    assert swept.lines() == alone


STOPPED = {"model": "imc-s8", "machine": "mill", "harms": ["stop"], "modes": ["transient"]}


def resuming(emulator, wait):
    """It waits until STOP is released, and goes on then."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.start_move_by(800, 0, 0, speed=900)
    while stepper.port.read(1) == b"F":
        wait(stepper.port)
        stepper.port.write(b"@0S\r")


def reading(port):
    port.timeout = 0.2
    assert port.read(1) == b""
    port.timeout = 1


@pytest.mark.parametrize("wait", [lambda port: time.sleep(0.2), lambda port: sleep(0.2), reading])
def test_what_passes_by_itself_has_passed_when_a_driver_has_waited(wait):
    swept = virtual.sweep(functools.partial(resuming, wait=wait), **STOPPED)
    assert swept.bad == [] and any("sent `@#S`" in outcome.did for outcome in swept.outcomes)
    assert {outcome.machine for outcome in swept.outcomes} == {"as it should be"}
    assert time.sleep is sleep


def power_fails(emulator, ask):
    """It begins again with a new reference run where it should, and forgets it otherwise."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    try:
        ask(stepper, "@0A800,900,0,900,0,900,0,900")
    except StepperError:
        ask(stepper, "@07")
        ask(stepper, "@0A800,900,0,900,0,900,0,900")


def reading_once(stepper, line):
    stepper.send(line)
    stepper.wait()


def polling_often(stepper, line):
    """It reads for a short time again and again, up to a time of its own."""
    stepper.port.timeout = 0.05
    stepper.send(line)
    end = time.monotonic() + 10
    while time.monotonic() < end:
        if answer := stepper.port.read(1):
            if answer != b"0":
                raise StepperError(line, answer.decode("ascii", "replace"))
            return
    raise StepperError(line, "")


@pytest.mark.parametrize("ask", [reading_once, polling_often])
def test_power_comes_back_while_a_driver_waits(ask):
    swept = virtual.sweep(
        functools.partial(power_fails, ask=ask), "imc-s8", "mill", harms=["power-off"], modes=["transient"]
    )
    assert "it moves before it has made a reference run" in {outcome.title for outcome in swept.bad}
    assert "it hangs" not in {outcome.title for outcome in swept.outcomes}


def recorded(emulator):
    moving(emulator)
    assert [one.mnemonic for one in emulator.commands()][-1] == "@A"
    assert emulator.journal().moves() and emulator.conversation()


def test_a_sweep_keeps_the_record():
    assert virtual.sweep(recorded, **STOPPED).bad == []


def slow_once(emulator, runs):
    """Something else keeps the computer busy, in one run only."""
    runs.append(1)
    moving(emulator)
    if len(runs) == 5:
        threading.Event().wait(2.3)


def test_a_driver_that_is_slow_once_does_not_hang():
    assert virtual.sweep(functools.partial(slow_once, runs=[]), **STOPPED).bad == []
