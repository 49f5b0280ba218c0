"""The line as a ``serial.Serial``. It needs pyserial."""

from __future__ import annotations

import io
import sys
import time
import urllib.parse
import warnings
from typing import TYPE_CHECKING, Any

import serial

from ._errors import Ended, Error, LineWarning

if TYPE_CHECKING:
    from ._emulator import Emulator
    from ._vimc4 import Port

#: What an address may ask of the emulator that it starts, and how it is read.
_OPTIONS = {
    "machine": str,
    "time": str,
    "flash": str,
    "recording": str,
    "line_pacing": lambda text: {"1": True, "0": False}[text],
}


class Serial(serial.SerialBase):  # type: ignore[misc]
    """A serial port that leads to an emulator in this process."""

    is_open: bool

    def __init__(self, *args: Any, emulator: Emulator | None = None, **kwargs: Any) -> None:
        self._emulator = emulator
        self._given = emulator is not None
        self._line: Port | None = None
        self._told: dict[str, bool] = {}
        super().__init__(*args, **kwargs)

    @property
    def emulator(self) -> Emulator:
        """The emulator at the other end: one that an address has started is the port's own, and
        ends with it."""
        if self._emulator is None:
            raise serial.PortNotOpenError()
        return self._emulator

    def open(self) -> None:
        """Opens the line."""
        if self._port is None:
            raise serial.SerialException("Port must be configured before it can be used.")
        if self.is_open:
            raise serial.SerialException("Port is already open.")
        if self._emulator is None:
            try:
                self._emulator, self._given = _of_address(self._port)
            except (Error, ValueError) as error:
                raise serial.SerialException(f"could not open {self._port}: {error}") from error
        try:
            self._line = self._emulator._core.connect().wait()
        except Ended as error:
            raise serial.SerialException(f"could not open {self._port}: {error}") from error
        self.is_open = True
        self._told = {}
        try:
            self._reconfigure_port()
            if not self._dsrdtr:
                self._update_dtr_state()
            if not self._rtscts:
                self._update_rts_state()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Closes the line, and ends an emulator that an address has started."""
        line, self._line = self._line, None
        if line is not None:
            line.close()
        if not self._given and self._emulator is not None:
            self._emulator.close()
            self._emulator = None
        self.is_open = False

    @property
    def _open_line(self) -> Port:
        if self._line is None:
            raise serial.PortNotOpenError()
        return self._line

    def _reconfigure_port(self) -> None:
        self._open_line
        speed = self.emulator.baud
        if self._baudrate != speed:
            _warn(f"the port has {self._baudrate:,} baud, the controller has {speed:,}")
        if self._parity != serial.PARITY_NONE or self._bytesize != serial.EIGHTBITS:
            _warn(f"the port has {self._bytesize} bits, parity {self._parity}, the controller 8 and N")

    # --- reading and writing ---

    @property
    def in_waiting(self) -> int:
        """How many bytes have come and are not read."""
        return self._open_line.in_waiting

    def read(self, size: int = 1) -> bytes:
        """Reads ``size`` bytes; fewer if they do not come in time."""
        line = self._open_line
        if self._inter_byte_timeout is None:
            data = line.read(size, self._timeout)
        else:
            data = self._read_with_gaps(line, size)
        if not data and size > 0 and line.ended:
            raise serial.SerialException("the emulator has ended")
        return data

    def _read_with_gaps(self, line: Port, size: int) -> bytes:
        end = None if self._timeout is None else time.monotonic() + self._timeout
        data = bytearray()
        while len(data) < size:
            left = None if end is None else max(0.0, end - time.monotonic())
            gap = self._inter_byte_timeout if data else left
            byte = line.read(1, gap if left is None else min(gap, left))
            if not byte:
                break
            data += byte
        return bytes(data)

    def write(self, data: Any) -> int:
        """Writes, and says how many bytes that were."""
        data = serial.to_bytes(data)
        try:
            written = self._open_line.write(data, self._write_timeout, bool(self._rtscts))
        except Ended as error:
            raise serial.SerialException(str(error)) from error
        if written < len(data) and self._write_timeout != 0:
            raise serial.SerialTimeoutException("Write timeout")
        return written

    def flush(self) -> None:
        """Nothing waits: what is written is on the line."""
        self._open_line

    @property
    def out_waiting(self) -> int:
        """Nothing waits: what is written is on the line."""
        self._open_line
        return 0

    def reset_input_buffer(self) -> None:
        """Forgets what has come and is not read."""
        self._open_line.reset_input_buffer()

    def reset_output_buffer(self) -> None:
        """Nothing waits: what is written is on the line."""
        self._open_line

    def cancel_read(self) -> None:
        """Whoever waits in `read` gets what has come so far."""
        if self._line is not None:
            self._line.cancel_read()

    def cancel_write(self) -> None:
        """Whoever waits in `write` goes on."""
        if self._line is not None:
            self._line.cancel_write()

    def fileno(self) -> int:
        """There is none: no operating system knows of this line."""
        raise io.UnsupportedOperation("fileno: the line is within the process; use Emulator(pty=True)")

    # --- lines ---

    def _update_rts_state(self) -> None:
        self._switch("RTS", bool(self._rts_state))

    def _update_dtr_state(self) -> None:
        self._switch("DTR", bool(self._dtr_state))

    def _switch(self, line: str, on: bool) -> None:
        # That DTR and RTS are on while the port is open, and there is no break, goes without saying.
        if self._told.get(line, line != "BREAK") != on:
            self._open_line.switch(line, on)
            self._told[line] = on

    def _update_break_state(self) -> None:
        self._switch("BREAK", bool(self._break_state))

    @property
    def cts(self) -> bool:
        """Whether a host may send now: off while the controller's buffer is full."""
        return self._open_line.cts

    @property
    def dsr(self) -> bool:
        """Whether the controller is there: as long as the emulator runs."""
        return not self._open_line.ended

    @property
    def cd(self) -> bool:
        """Whether the controller is there: as long as the emulator runs."""
        return not self._open_line.ended

    @property
    def ri(self) -> bool:
        """Nobody rings."""
        self._open_line
        return False


def _warn(text: str) -> None:
    # It is told of the line that has set the port up, outside of this package and of pyserial.
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and _is_ours(frame.f_globals.get("__name__", "")):
        level, frame = level + 1, frame.f_back
    warnings.warn(f"{text}; a real one would hear noise", LineWarning, stacklevel=level)


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] in ("serial", "vimc4")


def _of_address(address: str) -> tuple[Emulator, bool]:
    """The emulator that an address means, and whether it belongs to somebody else."""
    from ._emulator import Emulator, running

    parts = urllib.parse.urlsplit(address)
    options: dict[str, Any] = dict(
        urllib.parse.parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    )
    if parts.scheme != "vimc4" or parts.path.strip("/"):
        raise ValueError("write vimc4://MODEL, as in vimc4://imc-s8?time=instant")
    name = options.pop("emulator", None)
    if name is not None:
        if parts.netloc or options:
            raise ValueError("an emulator that runs has its model and its options already")
        emulator = running.get(name)
        if emulator is None or emulator.closed:
            raise ValueError(f"no emulator of the name {name} runs in this process")
        return emulator, True
    for option, text in options.items():
        if option not in _OPTIONS:
            known = ", ".join(["emulator", *_OPTIONS])
            raise ValueError(f"there is no option {option}; there are {known}")
        try:
            options[option] = _OPTIONS[option](text)  # type: ignore[operator]
        except KeyError:
            raise ValueError(f"{option} is 1 or 0, not {text}") from None
    return Emulator(parts.netloc or "imc4", **options), False
