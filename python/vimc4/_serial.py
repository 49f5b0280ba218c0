"""The line as a ``serial.Serial``. It needs pyserial."""

from __future__ import annotations

import contextlib
import io
import sys
import time
import urllib.parse
import warnings
from typing import TYPE_CHECKING, Any

import serial

from ._errors import Ended, Error, LineWarning
from ._port import whole

if TYPE_CHECKING:
    from collections.abc import Iterator

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


class Serial(serial.Serial):  # type: ignore[misc]
    """A serial port that leads to an emulator in this process."""

    is_open: bool
    fd: int | None = None

    def __init__(self, *args: Any, emulator: Emulator | None = None, **kwargs: Any) -> None:
        self._emulator = emulator
        self._given = emulator is not None
        # The address of the emulator.
        self._address = None if emulator is None else emulator.url
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
        if self._emulator is None or self._address != self._port:
            try:
                self._emulator, self._given = _of_address(self._port)
                self._address = self._port
            except (Error, ValueError) as error:
                raise serial.SerialException(f"could not open {self._port}: {error}") from error
        try:
            self._line = self._emulator._connect()
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
        with _as_pyserial():
            speed = self.emulator.baud
        if self._baudrate != speed:
            _warn(f"the port has {self._baudrate:,} baud, the controller has {speed:,}")
        if self._parity != serial.PARITY_NONE or self._bytesize != serial.EIGHTBITS:
            _warn(f"the port has {self._bytesize} bits, parity {self._parity}, the controller 8 and N")

    # --- reading and writing ---

    @property
    def in_waiting(self) -> int:
        """How many bytes have come and are not read."""
        line = self._open_line
        with _as_pyserial():
            count = line.in_waiting
            if count == 0:
                line.check()
        return count

    def read(self, size: int = 1) -> bytes:
        """Reads ``size`` bytes; fewer if they do not come in time."""
        line, size = self._open_line, whole(size)
        with _as_pyserial():
            if self._inter_byte_timeout is None:
                data = line.read(size, self._timeout)
            else:
                data = self._read_with_gaps(line, size)
            if not data and size > 0:
                line.check()
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
        data, line = serial.to_bytes(data), self._open_line
        with _as_pyserial():
            written, given_up = line.write(data, self._write_timeout, bool(self._rtscts))
        if written < len(data) and self._write_timeout != 0 and not given_up:
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
        line = self._open_line
        with _as_pyserial():
            line.reset_input_buffer()

    def reset_output_buffer(self) -> None:
        """Nothing waits: what is written is on the line."""
        self._open_line

    def cancel_read(self) -> None:
        """Whoever waits in `read` gets what has come so far."""
        if self._line is not None:
            self._line.cancel_read()

    def cancel_write(self) -> None:
        """Whoever waits in `write` goes on, with how much was written so far."""
        if self._line is not None:
            self._line.cancel_write()

    def fileno(self) -> int:
        """There is none: no operating system knows of this line."""
        raise io.UnsupportedOperation("fileno: the line is within the process; use Emulator(pty=True)")

    # --- what pyserial has for the operating system only, of which nothing is to be done here ---

    def set_input_flow_control(self, enable: bool = True) -> None:
        """Nobody obeys XON and XOFF."""
        self._open_line

    def set_output_flow_control(self, enable: bool = True) -> None:
        """Nobody obeys XON and XOFF."""
        self._open_line

    def set_low_latency_mode(self, low_latency_settings: bool) -> None:
        """It is as fast as it can be."""
        self._open_line

    def set_buffer_size(self, rx_size: int = 4096, tx_size: int | None = None) -> None:
        """On Windows, of its driver. Here nothing that has come is lost."""
        self._open_line

    def nonblocking(self) -> None:
        """There is no file to be set; ``timeout`` says how long reading waits."""
        self._open_line

    # --- lines ---

    def _update_rts_state(self) -> None:
        self._switch("RTS", bool(self._rts_state))

    def _update_dtr_state(self) -> None:
        self._switch("DTR", bool(self._dtr_state))

    def _switch(self, line: str, on: bool) -> None:
        # That DTR and RTS are on while the port is open, and there is no break, goes without saying.
        if self._told.get(line, line != "BREAK") != on:
            port = self._open_line
            with _as_pyserial():
                port.switch(line, on)
            self._told[line] = on

    def _update_break_state(self) -> None:
        self._switch("BREAK", bool(self._break_state))

    def send_break(self, duration: float = 0.25) -> None:
        """A break of so many seconds."""
        serial.SerialBase.send_break(self, duration)

    @property
    def cts(self) -> bool:
        """Whether a host may send now: off while the controller's buffer is full."""
        line = self._open_line
        with _as_pyserial():
            return line.cts

    @property
    def dsr(self) -> bool:
        """Whether the controller is there: as long as the emulator runs."""
        return not self._open_line.ended

    @property
    def cd(self) -> bool:
        """No carrier: a controller is no modem."""
        self._open_line
        return False

    @property
    def ri(self) -> bool:
        """Nobody rings."""
        self._open_line
        return False


@contextlib.contextmanager
def _as_pyserial() -> Iterator[None]:
    """What the line raises, as pyserial does."""
    try:
        yield
    except Ended as error:
        raise serial.SerialException(str(error)) from error
    except OSError:
        # Somebody else has closed it meanwhile.
        raise serial.PortNotOpenError() from None


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
    if parts.scheme != "vimc4" or parts.path.strip("/"):
        raise ValueError("write vimc4://MODEL, as in vimc4://imc-s8?time=instant")
    options: dict[str, Any] = {}
    for option, text in urllib.parse.parse_qsl(
        parts.query, keep_blank_values=True, strict_parsing=bool(parts.query)
    ):
        if option in options:
            raise ValueError(f"{option} is given twice, as {options[option]} and as {text}")
        options[option] = text
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
