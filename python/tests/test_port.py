"""The port is a ``serial.Serial`` in all things."""

import _thread
import inspect
import io
import threading
import time

import pytest
import serial
import vimc4 as virtual


@pytest.fixture
def port(vimc4):
    with vimc4.serial() as port:
        port.write(b"@07\r")
        assert port.read() == b"0"
        yield port


def test_nothing_of_pyserial_is_missing(port):
    assert isinstance(port, serial.Serial)
    assert isinstance(port, io.RawIOBase)
    public = {name for name in dir(serial.Serial) if not name.startswith("_")}
    assert public <= set(dir(port))
    # What pyserial does with a file is not done here.
    of_files = {
        name
        for name in vars(serial.Serial)
        if callable(getattr(serial.Serial, name)) and not name.startswith("__")
    } - vars(type(port)).keys()
    of_windows = {"_GetCommModemStatus", "_cancel_overlapped_io", "_close"}
    assert of_files <= {"_reset_input_buffer"} | of_windows
    for use in (port.set_input_flow_control, port.set_output_flow_control, port.nonblocking):
        use()
    port.set_low_latency_mode(True)
    port.set_buffer_size(rx_size=65_536)
    for name in public:
        mine, theirs = (getattr(kind, name) for kind in (type(port), serial.Serial))
        if inspect.isfunction(theirs) and name not in ("fileno",):
            given = list(inspect.signature(theirs).parameters)
            assert list(inspect.signature(mine).parameters)[: len(given)] == given, name


def test_settings_are_kept_and_changed(port):
    assert (port.baudrate, port.bytesize, port.parity, port.stopbits) == (19_200, 8, "N", 1)
    assert port.name == port.port == port.emulator.url
    port.timeout = 0
    assert port.timeout == 0 and port.read(5) == b""
    settings = port.get_settings()
    assert settings["timeout"] == 0
    port.apply_settings(settings | {"timeout": 1.5})
    assert port.timeout == 1.5
    assert "Serial<" in repr(port) and "open=True" in repr(port)


def test_wrong_speeds_are_told_of(port):
    with pytest.warns(virtual.LineWarning, match="9,600 baud, the controller has 19,200") as caught:
        port.baudrate = 9_600
    assert caught[0].filename == __file__
    with pytest.warns(virtual.LineWarning, match="parity E"):
        port.apply_settings({"baudrate": 19_200, "parity": "E"})


def test_reading_waits_and_gives_up(port):
    port.timeout = 0.05
    assert port.read(3) == b""
    port.write(b"@0P\r")
    port.timeout = 10
    assert port.read_until(b"0000") == b"0000"
    assert port.in_waiting == 15
    assert port.read(2) == b"00"
    assert port.read_all() == b"0" * 13
    assert port.in_waiting == port.inWaiting() == 0
    port.write(b"@0P\r")
    assert port.read_until(size=5) == b"00000"
    buffer = bytearray(4)
    assert port.readinto(buffer) == 4 and buffer == b"0000"
    port.inter_byte_timeout = 0.05
    assert port.read(100) == b"0" * 10
    assert port.read(0) == b""


def test_any_number_of_bytes_may_be_asked_for(port):
    assert port.read(-1) == port.read(-0.5) == b""
    port.write(b"@0P\r")
    assert port.read(1.0) == b"0"
    assert port.read(1.5) == b"00"
    port.timeout = 0.05
    assert port.read(10**20) == b"0" * 16
    with port.emulator.connect(timeout=0.05) as plain:
        assert plain.read(-1) == b""
        port.write(b"@0P\r")
        assert plain.read(10**20) == b"0" * 19


def test_buffers_are_emptied(port):
    port.write(b"@0P\r")
    assert port.emulator.now() >= 0
    assert port.in_waiting == 19
    port.reset_input_buffer()
    assert port.in_waiting == 0
    port.reset_output_buffer()
    port.flush()
    assert port.out_waiting == 0


def test_whoever_reads_is_called_off(port):
    port.timeout = None
    read = []
    reader = threading.Thread(target=lambda: read.append(port.read(10)))
    reader.start()
    while not read:
        # Before anybody reads there is nothing to call off: the next one would be.
        port.cancel_read()
        reader.join(0.01)
    assert read == [b""]


def test_threads_read_and_write_at_the_same_time(port):
    answers = []
    reader = threading.Thread(target=lambda: answers.append(port.read(19 * 300)))
    reader.start()
    for _ in range(300):
        port.write(b"@0P\r")
    reader.join(60)
    assert answers == [b"0" * 19 * 300]


@pytest.mark.vimc4(time="manual")
def test_several_threads_may_read(vimc4):
    port, read = vimc4.serial(timeout=60), []
    readers = [threading.Thread(target=lambda: read.append(port.read())) for _ in range(8)]
    for reader in readers:
        reader.start()
    port.write(b"@07\r" * 8)
    for reader in readers:
        reader.join(60)
    assert read == [b"0"] * 8


@pytest.fixture
def plotter(vimc4):
    """A board plotter that has homed; its commands wait in a buffer while it moves."""
    vimc4.run_until_idle()
    return vimc4


@pytest.mark.vimc4("smcu", "board-plotter", "manual")
def test_cts_is_off_while_the_buffer_is_full(plotter):
    with plotter.serial(rtscts=True, write_timeout=1) as port:
        assert port.cts
        with pytest.raises(serial.SerialTimeoutException):
            port.write(b"PR10,0;" * 1_000)
        assert not port.cts
        fill = plotter.view()["received"]
        assert fill["size"] / 2 < fill["used"] <= fill["size"]
        plotter.run_until_idle()
        assert port.cts and plotter.view()["received"]["used"] == 0
        assert plotter.position()[0] % 10 == 0


@pytest.mark.vimc4("smcu", "board-plotter", "manual")
def test_cts_lets_a_writer_go_on(plotter):
    with plotter.serial(rtscts=True) as port:
        writer = threading.Thread(target=lambda: port.write(b"PR10,0;" * 300))
        writer.start()
        while plotter.position()[0] < 3_000:
            plotter.run_until_idle()
        writer.join(60)
        assert not writer.is_alive()


@pytest.mark.vimc4("imc-s8", time="manual", record=False)
def test_ctrl_c_ends_the_writing_of_a_long_text_at_once(vimc4):
    port, other = vimc4.serial(write_timeout=None, rtscts=True), vimc4.serial(timeout=60)
    answered = []

    def interrupts():
        # It has begun.
        other.read(1)
        _thread.interrupt_main()
        answered.append(other.in_waiting)

    interrupter = threading.Thread(target=interrupts)
    with pytest.raises(KeyboardInterrupt):
        interrupter.start()
        port.write(b"@0P\r" * 100_000)
        interrupter.join(60)
    interrupter.join(60)
    vimc4.now()
    # What was on its way at most: an answer has 19 bytes.
    assert other.in_waiting - answered[0] < 1_000


@pytest.mark.parametrize("way", ["cancel_write", "close"])
@pytest.mark.vimc4("smcu", "board-plotter", "manual")
def test_a_writer_that_waits_for_cts_is_let_go(plotter, way):
    port = plotter.serial(rtscts=True)
    ended = []

    def write():
        try:
            ended.append(port.write(b"PR10,0;" * 1_000))
        except serial.SerialException as error:
            ended.append(error)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    while port.cts:
        time.sleep(0.001)
    # How many bytes still get in after CTS is off does not matter.
    getattr(port, way)()
    writer.join(60)
    assert len(ended) == 1
    if way == "close":
        assert isinstance(ended[0], serial.PortNotOpenError)
    else:
        assert 0 < ended[0] < 7_000
        # It is over with that.
        plotter.run_until_idle()
        assert port.write(b"PA0,0;") == 6


def test_a_host_without_handshake_overruns_the_buffer(vimc4):
    with virtual.Emulator(time="manual") as emulator:
        port = emulator.serial()
        port.write(b"@07\r")
        assert port.read() == b"0"
        port.write(b"@0A500,900,0,900,0,900,0,900\r" + b"@0P\r" * 2_000)
        assert any(event.get("warning") == "receive-overflow" for event in emulator.events())


def test_lines_of_the_host_are_reported(vimc4):
    reports = vimc4.reports("warning")
    with vimc4.serial() as port:
        assert port.dsr and not port.cd and not port.ri
        port.rts = False
        port.dtr = False
        assert (port.rts, port.dtr) == (False, False)
        port.send_break(0.01)
        assert not port.break_condition
    vimc4.now()
    news = []
    while report := reports.take():
        line = report["what"].get("news", {})
        if "host-line" in line:
            news.append((line["host-line"]["line"], line["host-line"]["on"]))
    # Both lines are on while a port is open, of which nothing is said.
    assert news == [("RTS", False), ("DTR", False), ("BREAK", True), ("BREAK", False)]


def test_a_port_is_closed_and_opened(vimc4):
    port = vimc4.serial()
    port.close()
    port.close()
    for use in (port.read, lambda: port.write(b"x"), lambda: port.in_waiting, port.flush):
        with pytest.raises(serial.PortNotOpenError):
            use()
    port.open()
    with pytest.raises(serial.SerialException, match="already open"):
        port.open()
    port.write(b"@07\r")
    assert port.read() == b"0"
    with pytest.raises(io.UnsupportedOperation, match="pty=True"):
        port.fileno()


def test_closing_lets_go_of_a_reader(vimc4):
    port = vimc4.serial(timeout=None)
    ended = []

    def read():
        try:
            ended.append(port.read(5))
        except serial.SerialException as error:
            ended.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    time.sleep(0.05)
    port.close()
    reader.join(60)
    assert len(ended) == 1


def test_the_end_of_an_emulator_is_the_end_of_its_port(vimc4):
    port = vimc4.serial()
    port.write(b"@07\r")
    vimc4.now()
    vimc4.close()
    # What was said is read; then it is as if the cable was pulled out.
    assert port.read() == b"0"
    with pytest.raises(serial.SerialException, match="has ended"):
        port.read()
    with pytest.raises(serial.SerialException, match="has ended"):
        port.write(b"@0P\r")
    with pytest.raises(serial.SerialException, match="has ended"):
        port.in_waiting
    with pytest.raises(serial.SerialException, match="has ended"):
        port.cts
    assert not port.dsr
    with pytest.raises(serial.SerialException, match="has ended"):
        vimc4.serial()
    with pytest.raises(virtual.Ended):
        vimc4.connect()


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("vimc4://imc-s9", "there is no model `imc-s9`"),
        ("vimc4://imc-s8?clock=instant", "there is no option clock; there are emulator, machine"),
        ("vimc4://imc-s8?time=fast", "`fast` is not a clock"),
        ("vimc4://imc-s8?line_pacing=yes", "line_pacing is 1 or 0"),
        ("vimc4://imc-s8/0", "write vimc4://MODEL"),
        ("vimc4://imc4?time=instant&time=manual", "time is given twice, as instant and as manual"),
        ("vimc4://?emulator=nobody", "no emulator of the name nobody"),
        ("vimc4://imc4?emulator=nobody", "has its model"),
    ],
)
def test_addresses_say_what_is_wrong_with_them(address, says):
    with pytest.raises(serial.SerialException, match=says.replace("?", r"\?")):
        serial.serial_for_url(address)


def test_an_address_is_opened_later():
    port = serial.serial_for_url("vimc4://?time=instant&machine=mill", 19_200, do_not_open=True)
    assert not port.is_open
    with pytest.raises(serial.PortNotOpenError):
        port.emulator
    with port:
        assert port.emulator.view()["machine"] == "mill"
        emulator = port.emulator
    assert emulator.closed


def test_another_address_is_another_port(vimc4):
    with vimc4.serial() as port:
        with pytest.raises(serial.SerialException, match="could not open /dev/nonsense"):
            port.port = "/dev/nonsense"
        assert not port.is_open
        with virtual.Emulator("imc-s8", time="instant") as other:
            port.port = other.url
            port.open()
            assert port.emulator is other
            port.port = vimc4.url
            assert port.is_open and port.emulator is vimc4


def test_it_does_without_pyserial(vimc4):
    with vimc4.connect(timeout=0.05) as port:
        assert port.readable() and port.writable()
        assert port.write(b"@07\r@0P\r") == 8
        assert port.read_until(b"00") == b"00"
        assert port.in_waiting == 18
        buffer = bytearray(2)
        assert port.readinto(buffer) == 2
        port.reset_input_buffer()
        assert port.read(5) == b""
    assert port.closed
    with pytest.raises(ValueError, match="closed"):
        with port:
            pass
