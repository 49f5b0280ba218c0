"""Drivers for the tests of sweeps: a module of its own, so that other processes can import it."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "python"))

from stepper import Stepper


def careful(emulator):
    """Every answer that is not as it should be is an error."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.move_by(800, 0, 0, speed=900)
    if stepper.position() != (800, 0, 0):
        raise ValueError("it is elsewhere")


def careless(emulator):
    """Nobody looks at the answer of the move."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.start_move_by(800, 0, 0, speed=900)
    stepper.port.read(1)


def assertive(emulator):
    """A driver of another file asserts what it is answered."""
    stepper = Stepper(emulator.serial(timeout=1))
    stepper.reference()
    stepper.start_move_by(800, 0, 0, speed=900)
    assert stepper.port.read(1) == b"0"
    return stepper


def patient(emulator):
    """It waits for ever."""
    Stepper(emulator.serial(timeout=None)).reference()
