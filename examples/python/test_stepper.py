"""The driver meets what a machine rarely does, and never when somebody looks."""

import os
import tempfile
import unittest

import serial

from stepper import Stepper, StepperError
from virtual_controller import VirtualController


class StepperTest(unittest.TestCase):
    def start(self, *arguments):
        controller = VirtualController(*arguments)
        self.addCleanup(controller.close)
        return controller

    def connect(self, controller, timeout=10):
        port = serial.serial_for_url(controller.url, timeout=timeout)
        self.addCleanup(port.close)
        return port

    def fails(self, code):
        return self.assertRaisesRegex(StepperError, f"was answered '{code}'")

    def test_a_serial_port_by_name(self):
        with tempfile.TemporaryDirectory() as folder:
            link = os.path.join(folder, "controller")
            controller = self.start("--time", "instant", "--pty", link)
            with serial.Serial(link, 19200, timeout=10) as port:
                stepper = Stepper(port)
                stepper.move_by(600_000, -1, 0, speed=1_000)  # ten minutes
                self.assertEqual(stepper.position(), (600_000, -1, 0))
            self.assertEqual(controller.order("position"), "X 600000 Y -1 Z 0 A 0")

    def test_stop_halts_at_step_2500_and_resume_finishes_the_move(self):
        controller = self.start("--time", "manual")
        stepper = Stepper(self.connect(controller))
        # 250 Hz is below the start-stop frequency: without a ramp the axis halts on the step.
        stepper.start_move_by(5_000, 0, 0, speed=250)
        self.run_until(controller, "X 2500 Y 0 Z 0 A 0")
        controller.order("press stop")
        with self.fails("F"):
            stepper.wait()
        self.assertEqual(stepper.position(), (2_500, 0, 0))
        stepper.start_resume()
        self.run_until(controller, "X 5000 Y 0 Z 0 A 0")
        stepper.wait()

    def run_until(self, controller, position):
        # A command and an order take different ways, and the order may arrive first. Time then
        # passes before the move and not within it: in steps of a second, 250 steps each, the
        # position is reached exactly all the same.
        for _ in range(100):
            if controller.order("position") == position:
                return
            controller.order("advance 1s")
        self.fail(f"the machine does not come to {position}")

    def test_a_limit_switch_is_reported(self):
        controller = self.start("--machine", "mill", "--time", "instant")
        stepper = Stepper(self.connect(controller))
        stepper.reference()
        with self.fails("2"):
            stepper.move_by(30_000, 0, 0, speed=4_000)
        self.assertEqual(stepper.position(), (24_001, 0, 0))

    def test_the_open_cover_is_reported(self):
        controller = self.start("--time", "instant")
        stepper = Stepper(self.connect(controller))
        controller.order("cover open")
        with self.fails("H"):
            stepper.move_by(100, 0, 0, speed=900)
        controller.order("cover closed")
        stepper.move_by(100, 0, 0, speed=900)

    def test_a_power_failure_is_noticed(self):
        controller = self.start("--time", "instant")
        stepper = Stepper(self.connect(controller, timeout=0.1))
        controller.order("power off")
        with self.fails(""):
            stepper.position()
        controller.order("power on")
        with self.fails("4"):
            stepper.move_by(100, 0, 0, speed=900)

    def test_inputs_are_read(self):
        controller = self.start("--model", "imc-s8", "--time", "instant")
        stepper = Stepper(self.connect(controller))
        self.assertEqual(stepper.read_input(0), 0b0000_0000)
        controller.order("input 0.3 1")
        self.assertEqual(stepper.read_input(0), 0b0000_1000)


if __name__ == "__main__":
    unittest.main()
