"""What the slide does with a virtual controller, whose address is in the variable CONTROLLER."""

import os
import unittest

from slide import Slide


class SlideTest(unittest.TestCase):
    def setUp(self):
        host, port = os.environ["CONTROLLER"].rsplit(":", 1)
        self.slide = Slide(host, int(port))
        self.addCleanup(self.slide.close)
        self.slide.reference()

    def test_the_second_sample_comes_under_the_camera(self):
        self.slide.move_by(120)
        self.assertEqual(self.slide.place(), 120)

    def test_the_fourth_sample_comes_under_the_camera(self):
        for _ in range(3):
            self.slide.move_by(120)
        self.assertEqual(self.slide.place(), 360)


if __name__ == "__main__":
    unittest.main()
