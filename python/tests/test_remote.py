"""Controllers that are served elsewhere: the program that serves them is the real one."""

import json
import os
import subprocess
import threading
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

import vimc4 as virtual


@pytest.fixture
def serve(root, tmp_path):
    """Starts `vimc4 serve` with more arguments, and returns what it says when it is ready."""
    program = Path(os.environ.get("VIMC4") or root / "target" / "debug" / "vimc4")
    assert program.exists(), "build it with `cargo build`, or say with VIMC4 where it is"
    started = []

    def start(*arguments):
        given = ["serve", "--json", "--machine", "mill", "--pty", "none", "--tcp", "127.0.0.1:0", "--web"]
        serve = subprocess.Popen(
            [program, *given, *arguments],
            cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        started.append(serve)
        return json.loads(serve.stdout.readline())

    yield start
    for serve in started:
        serve.kill()
        serve.communicate(timeout=60)


@pytest.fixture
def url(serve):
    return serve("--time", "manual")["http"]


def test_a_controller_elsewhere_is_led_over_http(url):
    with virtual.connect(url) as mill:
        mill.send(b"@01\r@0A5000,900\r")
        assert mill.run_until("x > 2499") == 2_779_777_778
        mill.press("stop")
        mill.run_until_idle()
        assert [entry["bytes"] for entry in mill.journal("answer")] == ["0", "F"]
        assert mill.position()[0] < 2_510


def test_what_is_wrong_says_what_would_be_right(url):
    mill = virtual.connect(url)
    with pytest.raises(virtual.Refused, match="`cover` cannot be `shut`; it can be open or closed") as told:
        mill.order("cover shut")
    assert (told.value.kind, told.value.status) == ("not-understood", 422)
    assert told.value.remedy == "it can be open or closed"
    mill.pause()
    with pytest.raises(virtual.Refused, match="time is paused"):
        mill.advance("1s")
    mill.resume()
    assert mill.advance("1s") == 1_000_000_000


def test_what_is_seen_and_done_there(url):
    mill = virtual.connect(url)
    assert mill.about["machine"] == "mill" and mill.controllers() == [mill.about]
    assert mill.view()["activity"] == "idle"
    cover = next(signal for signal in mill.signals() if signal.name == "cover")
    assert cover.kind == "switch" and cover.positions == ("open", "closed")
    assert mill.turn("cover", "open") and mill.value("cover") == 0
    assert not mill.set_signal("cover", 0)
    assert mill.press("estop") == mill.release("estop") == "ok"
    assert "press stop" in [line for line, _ in mill.complete("press st")]
    assert mill.power(True).startswith("ok")
    with mill.fault("drop to-host once") as fault:
        assert mill.faults() == [(fault.number, "drop to-host once", "strikes", 0)]
    assert mill.faults() == []
    with mill.scenario("when x > 10: press stop") as scenario:
        assert [rule.scenario for rule in mill.rules()] == [scenario.number]
        mill.end_scenarios()
    assert mill.rules() == [] and not mill.reset()


def test_states_are_kept_and_breakpoints_pause(url):
    mill = virtual.connect(url)
    mill.send(b"@01\r")
    before = mill.snapshot("before")
    mill.send(b"@0A5000,900\r")
    mark = mill.break_when("x > 99")
    mill.run_until_idle()
    clock = mill.clock()
    assert clock["paused"]["breakpoints"] == [mark] and mill.position()[0] == 100
    assert mill.step() == "cause"
    assert mill.breakpoints()[0]["met"] == 1
    mill.remove_breakpoint(mark)
    mill.resume()
    assert mill.restore(before) == 0 and mill.position()[0] == 0
    assert [kept["name"] for kept in mill.snapshots()] == ["before"]
    mill.forget(before)
    assert mill.snapshots() == []


def test_what_happens_is_told_as_it_happens(serve):
    url = serve("--time", "instant", "--count", "2")["http"]
    mill = virtual.connect(url, controller=2)
    with mill.events("command", "answer", timeout=60) as events:
        mill.send(b"@01\r@0A5000,900\r")
        assert [next(events)["bytes"] for _ in range(4)] == ["@01", "0", "@0A5000,900", "0"]
        seen = list(mill.journal("command"))
        mill.send(b"@07\r" * 100)
        assert [next(events)["kind"] for _ in range(200)] == ["command", "answer"] * 100
    with mill.events("command", after=seen[0]["number"], timeout=60) as events:
        assert next(events)["number"] == seen[1]["number"]
    with mill.events("flash", timeout=0.05) as events:
        for _ in range(2):
            with pytest.raises(virtual.Late):
                next(events)
    with pytest.raises(virtual.Refused, match="there is no kind of entry `foo`") as told:
        mill.events("foo")
    assert told.value.kind == "not-understood"
    # The end of the server is the end of what happens.
    with mill.events() as events:
        mill.quit()
        assert isinstance(list(events), list)
    with pytest.raises(virtual.PortError, match="is `vimc4 serve --http` running there"):
        mill.now()


def test_a_waiting_thread_is_released_by_another(serve):
    mill = virtual.connect(serve("--time", "real")["http"])
    mill.send(b"@01\r@0A23000,21\r")
    with pytest.raises(virtual.Late, match="0.05 s"):
        mill.run_until("x > 20000", timeout=0.05)
    refused = []

    def wait():
        with pytest.raises(virtual.Refused) as told:
            mill.run_until("x > 20000")
        refused.append(told.value)

    thread = threading.Thread(target=wait)
    thread.start()
    while thread.is_alive():
        mill.cancel_all()
        thread.join(0.01)
    assert refused[0].kind == "not-now"


def test_the_debugger_goes_back_and_ends_with_its_block(serve):
    url = serve("--time", "100x")["http"]
    with virtual.connect(url) as mill:
        assert "idle" in mill.debug("where")
        for line in ["send @01", "send @0A5000,900", "step command", "step command", "continue 1s"]:
            mill.debug(line)
        assert "@0A5000,900" in mill.debug("back command")
        assert mill.clock()["paused"] is not None
    assert mill.clock()["paused"] is None
    mill.set_clock("1000x")
    mill.run_until_idle()
    assert mill.position()[0] == 5_000


def test_a_token_is_sent_where_there_is_one(serve, tmp_path, monkeypatch):
    (tmp_path / "token.txt").write_text("0123456789abcdef\n")
    url = serve("--http-token", "token.txt")["http"]
    with pytest.raises(virtual.Refused, match="the token is missing or wrong"):
        virtual.connect(url)
    mill = virtual.connect(url, token="0123456789abcdef")
    with mill.events(after=0) as events:
        mill.turn("cover", "open")
        assert next(events)["kind"] == "news"
    monkeypatch.setenv("VIMC4_URL", url)
    monkeypatch.setenv("VIMC4_TOKEN", "0123456789abcdef")
    assert virtual.connect().value("cover") == 0
    assert virtual.connect(url.removeprefix("http://").rstrip("/")).value("cover") == 0
    wrong = ["https://127.0.0.1", "http://", "http://127.0.0.1/v1", "http://[::1", "", "127.0.0.1:http"]
    for address in [*wrong, "http://me@127.0.0.1", "http://127.0.0.1?x", "127.0.0.1#x"]:
        with pytest.raises(virtual.PortError, match="is no address of the API"):
            virtual.connect(address)
    with pytest.raises(TypeError, match="5 is no address of the API; it is as in http://"):
        virtual.connect(5)
    monkeypatch.delenv("VIMC4_URL")
    with pytest.raises(virtual.PortError, match="no address is given; give one, as in .*, or set VIMC4_URL"):
        virtual.connect()


def test_texts_of_the_api_are_told_as_they_are(url):
    mill = virtual.connect(url)
    image = mill.ask("GET", "/flash")
    assert isinstance(image, str)
    assert mill.ask("PUT", "/flash", {"image": image}) is not None
    mill.ask("POST", "/recording")
    mill.send(b"@01\r")
    lines = mill.ask("GET", "/recording").splitlines()
    assert len(lines) > 1 and all(isinstance(json.loads(line), dict) for line in lines)


@pytest.mark.parametrize("sort", ["text/html", "application/json"])
def test_another_server_is_no_controller(sort):
    class Other(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", sort)
            self.end_headers()
            self.wfile.write(b"<html></html>")

        def log_message(self, *_):
            pass

    with HTTPServer(("127.0.0.1", 0), Other) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            with pytest.raises(virtual.PortError, match="it answers with something else"):
                virtual.connect(f"http://127.0.0.1:{server.server_port}")
        finally:
            server.shutdown()


def test_arguments_are_those_of_an_emulator(url):
    mill = virtual.connect(url)
    assert mill.advance(timedelta(milliseconds=250)) == 250_000_000
    for span in (5, None, timedelta(-1)):
        with pytest.raises(TypeError, match='a span of time is a text with a unit, as in "250ms", or a timedelta'):
            mill.advance(span)
    mill.send(bytearray(b"@01\r"))
    with pytest.raises(TypeError, match=r"'@01' cannot be sent; give bytes, as in b'@07\\r'"):
        mill.send("@01")
    assert [entry["bytes"] for entry in mill.journal("command")] == ["@01"]
    with pytest.raises(virtual.Refused, match="there is no kind of entry `bogus`"):
        mill.journal("bogus")
    assert repr(mill) == f"<vimc4.Remote 1: imc4 on mill, at {url}>"
    fault, scenario = mill.fault("drop to-host once"), mill.scenario("when x > 10: press stop")
    assert repr(fault) == f"<vimc4.RemoteFault {fault.number} of 1 at {url}>"
    scenario.end()
    assert repr(scenario) == f"<vimc4.RemoteScenario {scenario.number} of 1 at {url}, ended>"
