"""What a machine does rarely, and never when somebody looks."""

import asyncio

import pytest
import vimc4 as virtual
from stepper import Stepper, StepperError


def fails(code):
    return pytest.raises(StepperError, match=f"was answered '{code}'")


@pytest.mark.vimc4(time="manual")
def test_stop_halts_at_step_2500_and_resume_finishes_the_move(vimc4):
    stepper = Stepper(vimc4.serial())

    # 300 Hz is the start-stop frequency: without a ramp the axis halts on the step.
    stepper.start_move_by(5_000, 0, 0, speed=300)
    vimc4.run_until("x = 2500")
    vimc4.press("stop")
    with fails("F"):
        stepper.wait()
    assert stepper.position() == (2_500, 0, 0)

    stepper.start_resume()
    vimc4.run_until_idle()
    stepper.wait()
    assert stepper.position() == (5_000, 0, 0)


@pytest.mark.vimc4(machine="mill")
def test_a_limit_switch_is_reported_until_the_next_reference_run(vimc4):
    stepper = Stepper(vimc4.serial())
    stepper.reference()

    # The switch at the end of X is at step 24,001.
    with fails("2"):
        stepper.move_by(30_000, 0, 0, speed=4_000)
    assert stepper.position() == (24_001, 0, 0)
    with fails("2"):
        stepper.move_by(-100, 0, 0, speed=4_000)

    stepper.reference()
    stepper.move_by(100, 0, 0, speed=4_000)


@pytest.mark.vimc4(time="manual")
def test_after_a_power_failure_the_controller_knows_no_axes(vimc4):
    with vimc4.serial(timeout=0.02) as port:
        stepper = Stepper(port)
        stepper.start_move_by(5_000, 0, 0, speed=900)
        vimc4.run_until("x = 2500")
        vimc4.power(False)
        with fails(""):
            stepper.wait()
        vimc4.power(True)

    stepper = Stepper(vimc4.serial())
    # It believes to stand at zero, but the carriage is where the power left it, and some
    # steps further: a motor that is switched off in motion runs on.
    assert stepper.position() == (0, 0, 0)
    assert vimc4.view()["axes"][0]["carriage"] == 2_503


def test_a_power_failure_between_two_moves_is_noticed(vimc4):
    stepper = Stepper(vimc4.serial())
    vimc4.power(False)
    vimc4.power(True)
    with fails("4"):
        stepper.move_by(100, 0, 0, speed=900)


def test_the_host_sends_what_it_should(vimc4):
    stepper = Stepper(vimc4.serial())
    stepper.move_by(4_000, -250, 0, speed=900)

    commands = vimc4.commands()
    assert [command.bytes for command in commands] == [b"@07", b"@0A4000,900,-250,900,0,900,0,900"]
    assert commands[1].mnemonic == "@A"
    assert commands[1].text.startswith("relative move X +4,000 steps at 900 Hz, Y -250 steps")


@pytest.fixture
def referenced(vimc4):
    """A mill after its reference run."""
    with vimc4.serial() as port:
        port.write(b"@07\r@0R7\r")
        vimc4.run_until_idle()
        assert port.read(2) == b"00"
    return vimc4.snapshot()


@pytest.mark.vimc4(machine="mill", time="manual")
def test_whatever_happens_in_the_middle_is_reported(vimc4, referenced):
    # Everything is tried from the same point. The snapshot holds the controller and its
    # machine, not the driver: it is taken while no driver waits, and each try has a new one.
    def after(happens):
        vimc4.restore(referenced)
        with vimc4.serial() as port:
            stepper = Stepper(port)
            stepper.start_move_by(5_000, 0, 0, speed=900)
            vimc4.run_until("x = 1000")
            happens()
            vimc4.run_until_idle()
            stepper.wait()

    after(lambda: None)
    with fails("F"):
        after(lambda: vimc4.press("stop"))
    with fails("H"):
        after(lambda: vimc4.turn("cover", "open"))
    with fails("2"):
        after(lambda: vimc4.set_signal("limit x+", 1))
    with fails("9"):
        after(lambda: vimc4.press("estop"))


def test_an_emergency_stop_reaches_a_task_that_waits():
    async def ask(reader, writer, line):
        writer.write(line + b"\r")
        return await reader.readexactly(1)

    async def main():
        with virtual.Emulator(time="manual") as emulator:
            aio = emulator.aio
            reader, writer = await aio.connect()
            assert await ask(reader, writer, b"@07") == b"0"

            move = b"@0A5000,900,0,900,0,900,0,900"
            driver = asyncio.create_task(ask(reader, writer, move))
            await aio.next_command("@A")
            await aio.run_until("x = 2500")
            await aio.press("estop")
            assert await driver == b"9"
            # The counter begins anew, as after power-on.
            assert (await aio.position())[0] == 0
            writer.close()

    asyncio.run(main())
