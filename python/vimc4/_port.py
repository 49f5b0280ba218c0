"""The line from within the process, for those who do without pyserial."""

from __future__ import annotations

import io
import math
import sys
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import _vimc4


def whole(size: float) -> int:
    """How many bytes are to be read where pyserial reads while there are fewer than ``size``."""
    return max(0, math.ceil(min(size, sys.maxsize)))


class Port(io.RawIOBase):
    """A serial port that leads to an emulator in this process, with the methods of pyserial that
    every driver uses. `Emulator.serial` gives one that is a ``serial.Serial`` in all things."""

    timeout: float | None
    """How many seconds reading waits; None for ever."""
    write_timeout: float | None
    """How many seconds writing waits where a megabyte waits to be taken; None for ever."""

    def __init__(
        self,
        line: _vimc4.Port,
        timeout: float | None = 10.0,
        write_timeout: float | None = 10.0,
    ) -> None:
        super().__init__()
        self._line = line
        self.timeout = timeout
        self.write_timeout = write_timeout

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def read(self, size: int = 1) -> bytes:
        """Reads ``size`` bytes; fewer if they do not come in time."""
        return self._line.read(whole(size), self.timeout)

    def readinto(self, buffer: Any) -> int:
        """Reads into a buffer, and says how many bytes that were."""
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Reads up to and with these bytes; fewer if they do not come in time."""
        end = None if self.timeout is None else time.monotonic() + self.timeout
        data = bytearray()
        while not data.endswith(expected) and (size is None or len(data) < size):
            left = None if end is None else max(0.0, end - time.monotonic())
            byte = self._line.read(1, left)
            if not byte:
                break
            data += byte
        return bytes(data)

    def write(self, data: Any) -> int:
        """Writes, and says how many bytes that were."""
        return self._line.write(bytes(data), self.write_timeout)[0]

    @property
    def in_waiting(self) -> int:
        """How many bytes have come and are not read."""
        return self._line.in_waiting

    def reset_input_buffer(self) -> None:
        """Forgets what has come and is not read."""
        self._line.reset_input_buffer()

    def close(self) -> None:
        """Closes the line."""
        self._line.close()
        super().close()
