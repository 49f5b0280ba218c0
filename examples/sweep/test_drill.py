"""The tests of the driver: the happy path, as most tests have it.

`python3 -m unittest discover examples/sweep` runs them on the controller at VIMC4_PORT. DRIVER=mended
tests the other driver."""

import importlib
import os
import unittest

driver = importlib.import_module(os.environ.get("DRIVER", "drill"))

HOLES = [(1_600, 800), (2_400, 1_600)]


class TestDrill(unittest.TestCase):
    def test_it_drills_the_holes(self):
        drill = driver.Drill(os.environ["VIMC4_PORT"])
        self.assertEqual(drill.drill(HOLES), len(HOLES))


if __name__ == "__main__":
    unittest.main()
