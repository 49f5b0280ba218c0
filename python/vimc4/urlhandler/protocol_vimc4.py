"""``serial.serial_for_url("vimc4://imc-s8?time=instant")``."""

from vimc4._serial import Serial

__all__ = ["Serial"]
