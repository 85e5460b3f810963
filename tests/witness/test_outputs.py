"""Heartbeats stop with the monitor; the endpoint shows the rig's figures."""

import socket
import ssl
import struct
import threading
import urllib.error
import urllib.request
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import ConfigError, RigwatchError
from rigwatch.wire.host import free_port
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    HEALTH,
    MOST_SOURCES,
    EstimateBlock,
    Health,
)
from rigwatch.wire.rig_config import SecuritySection, WitnessSection
from rigwatch.witness import beats
from rigwatch.witness.addresses.bounded import MOST_HUNG
from rigwatch.witness.addresses.connections import Connections
from rigwatch.witness.addresses.http_ping import why_not
from rigwatch.witness.beats import Pinger
from rigwatch.witness.metrics import Endpoint, Figures
from rigwatch.witness.process import Witness
from tests.access.secured_rig import make_keys
from tests.waiting import eventually
from tests.witness.test_delivery import Drip
from tests.witness.test_people import fault


def page(url: str, context: ssl.SSLContext | None = None) -> str:
    with urllib.request.urlopen(url, timeout=30, context=context) as answer:
        return str(answer.read().decode())


def test_the_endpoint_shows_monitor_alarms_and_every_process() -> None:
    network, port = MemoryNetwork(), free_port()
    monitor = network.bus("r", "monitor")
    settings = WitnessSection(metrics=f"127.0.0.1:{port}")
    witness = Witness(settings, network.bus("r", "witness"), 0.0)
    monitor.publish(ESTIMATES, EstimateBlock("rig", 7, 0, np.zeros(1, np.int64), ()))
    monitor.publish(ALARMS, fault())
    counters = {"rate_hz": 256.0, "lost_samples": 3.0}
    monitor.publish(HEALTH, Health("daq/rig", 1, "running", "", counters))
    witness.turn(10.0, 1)
    text = page(f"http://127.0.0.1:{port}/metrics")
    assert 'rigwatch_monitor_age_seconds{rig="r"} 0.0' in text
    assert 'rigwatch_alarms{rig="r",severity="error",state="unacknowledged"} 1.0' in text
    assert 'rigwatch_figure{figure="lost_samples",process="daq/rig",rig="r"} 3.0' in text
    assert 'rigwatch_process_up{process="daq/rig",rig="r"} 1.0' in text
    monitor.publish(ALARMS, fault(state="acknowledged"))
    witness.turn(20.0, 1)
    text = page(f"http://127.0.0.1:{port}/metrics")
    assert 'rigwatch_monitor_age_seconds{rig="r"} 10.0' in text
    assert 'rigwatch_alarms{rig="r",severity="error",state="acknowledged"} 1.0' in text
    assert 'severity="error",state="unacknowledged"' not in text
    assert 'rigwatch_process_up{process="daq/rig",rig="r"} 0.0' in text
    with pytest.raises(RigwatchError, match="cannot listen"):
        Witness(settings, network.bus("r", "witness"), 0.0)
    witness.close()


def test_the_figures_stay_bounded() -> None:
    figures = Figures("r")
    for number in range(3 * MOST_SOURCES):
        figures.take_health(Health(f"p{number}", 1, "running", "", {}), 0.0)
    (alive,) = (f for f in figures.collect() if f.name == "rigwatch_process_up")
    assert len(alive.samples) == MOST_SOURCES


def test_a_collector_that_goes_away_is_no_traceback(capfd: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    endpoint = Endpoint(f"127.0.0.1:{port}", Figures("r"), SecuritySection())
    before = serving()
    for _ in range(20):
        with socket.create_connection(("127.0.0.1", port), 30.0) as line:
            line.sendall(b"GET /metrics HTTP/1.1\r\nHost: x\r\n")
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    eventually(lambda: serving() <= before, "the threads of the connections have ended")
    assert "rigwatch_monitor_age_seconds" in page(f"http://127.0.0.1:{port}/metrics")
    endpoint.close()
    assert "Traceback" not in capfd.readouterr().err


def serving() -> set[threading.Thread]:
    """Threads that serve a connection, also one that a client of an earlier test keeps open."""
    return {one for one in threading.enumerate() if "process_request_thread" in one.name}


def test_beyond_loopback_the_endpoint_asks_for_a_certificate(tmp_path: Path) -> None:
    keys, port = make_keys(tmp_path / "keys"), free_port()
    figures = Figures("r")
    with pytest.raises(ConfigError, match="without keys, expected a loopback address"):
        Endpoint("0.0.0.0:1", figures, SecuritySection())
    with pytest.raises(ConfigError, match="host and port"):
        Endpoint("9464", figures, SecuritySection())
    endpoint = Endpoint(f"0.0.0.0:{port}", figures, SecuritySection(keys=str(keys)))
    trusting = ssl.create_default_context(cafile=str(keys / "authority.pem"))
    trusting.check_hostname = False
    url = f"https://127.0.0.1:{port}/metrics"
    with pytest.raises((urllib.error.URLError, ssl.SSLError, OSError)):
        page(url, trusting)
    trusting.load_cert_chain(keys / "ann.pem", keys / "ann.key")
    assert "rigwatch_monitor_age_seconds" in page(url, trusting)
    endpoint.close()


class Switch(BaseHTTPRequestHandler):
    hits: ClassVar[list[str]]

    def do_GET(self) -> None:
        self.hits.append(self.path)
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


def test_the_ping_comes_while_estimates_do() -> None:
    hits: list[str] = []
    server = HTTPServer(("127.0.0.1", 0), type("Switch", (Switch,), {"hits": hits}))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    network = MemoryNetwork()
    monitor, url = network.bus("r", "monitor"), f"http://127.0.0.1:{server.server_port}/rig"
    settings = WitnessSection(heartbeat_url=url, heartbeat_seconds=10.0)
    witness = Witness(settings, network.bus("r", "witness"), 0.0)
    now = 0.0
    for expected in (1, 2):
        monitor.publish(ESTIMATES, EstimateBlock("rig", 7, 0, np.zeros(1, np.int64), ()))
        now += 10.0
        witness.turn(now, 1)
        eventually(lambda wanted=expected: len(hits) == wanted, "the ping")
    witness.turn(now + 9.0, 1)
    witness.turn(now + 30.0, 1)
    assert len(hits) == 2
    server.shutdown()
    server.server_close()


def test_a_ping_that_fails_is_counted_and_waits_nowhere() -> None:
    pinger = Pinger(f"http://127.0.0.1:{free_port()}", 1.0)
    pinger.beat(0.0)
    eventually(lambda: pinger.failed == 1, "the failure")
    assert pinger.trouble == "heartbeat_url cannot be reached: connection refused"
    with pytest.raises(ConfigError, match="http:// or https://"):
        Pinger("file:///etc/passwd", 1.0)


@pytest.mark.parametrize("answer", [b"what do you want?\r\n\r\n", b"H"])
def test_a_server_that_does_not_speak_http_or_never_ends_is_told_and_does_not_end_the_pings(
    answer: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(beats, "WHOLE", 0.2)
    with Drip(answer) as drip:
        pinger = Pinger(f"http://127.0.0.1:{drip.server_address[1]}/secret", 1.0)
        for count in (1, 2):
            pinger.beat(float(count))
            eventually(lambda wanted=count: pinger.failed == wanted, "the failure")
        drip.shutdown()
    told = "not finished within 0.2 s" if answer == b"H" else "the answer is not HTTP"
    assert pinger.trouble == f"heartbeat_url cannot be reached: {told}"


def test_a_heartbeat_file_that_cannot_be_written_is_told_until_it_can(tmp_path: Path) -> None:
    network, file = MemoryNetwork(), tmp_path / "away" / "beat"
    healths = network.bus("r", "screen").subscribe(HEALTH)
    settings = WitnessSection(heartbeat_file=str(file))
    witness = Witness(settings, network.bus("r", "witness"), 0.0)

    def text(now: float) -> str:
        witness.turn(now, 1)
        return str(healths.drain()[-1].text)

    assert text(1.0) == ""
    assert text(2.0) == f"heartbeat file {file} cannot be written: no such file or directory"
    file.parent.mkdir()
    text(3.0)
    assert text(4.0) == ""
    assert file.is_file()


def drip_in_headers(_: socket.socket) -> bytes:
    return b"H"


def drip_in_a_redirection(request: socket.socket) -> bytes:
    request.recv(1000)
    head = b"HTTP/1.1 302 Found\r\nLocation: /elsewhere\r\nContent-Length: 1000000\r\n\r\n"
    request.sendall(head)
    return b"x"


def drip_in_the_handshake(request: socket.socket) -> bytes:
    request.recv(1000)
    request.sendall(b"\x16\x03\x03\x40\x00")  # a record of 16 kB is announced
    return b"\x02"


@pytest.mark.parametrize(
    ("scheme", "begin"),
    [
        ("http", drip_in_headers),
        ("http", drip_in_a_redirection),
        ("https", drip_in_the_handshake),
    ],
    ids=["headers", "redirection", "handshake"],
)
def test_pings_go_on_after_a_server_that_never_ended_its_answers(
    scheme: str, begin: Callable[[socket.socket], bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(beats, "WHOLE", 0.2)
    with Drip(begin=begin) as drip:
        pinger = Pinger(f"{scheme}://127.0.0.1:{drip.server_address[1]}/", 1.0)
        idle = pings()  # the threads of all pingers so far, each of which waits for its next ping
        for count in range(1, MOST_HUNG + 3):
            pinger.beat(float(count))
            eventually(lambda wanted=count: pinger.failed == wanted, "the failure")
            assert pinger.trouble.endswith("not finished within 0.2 s")
            eventually(lambda: pings() == idle, "the request has ended")
        drip.shutdown()


def pings() -> int:
    return sum(thread.name == "ping" for thread in threading.enumerate())


def test_a_redirection_is_followed_and_a_refusal_is_told_by_its_number() -> None:
    class Moved(Switch):
        hits: ClassVar[list[str]] = []

        def do_GET(self) -> None:
            self.hits.append(self.path)
            code = {"/old": 302, "/new": 200}.get(self.path, 404)
            self.send_response(code)
            self.send_header("Location", "/new")
            self.end_headers()

    server = HTTPServer(("127.0.0.1", 0), Moved)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}"
    assert why_not(f"{url}/old", 5.0) == ""
    assert Moved.hits == ["/old", "/new"]
    assert why_not(f"{url}/gone", 5.0) == "the server answers 404"
    cut = Connections()
    cut.cut()
    with cut.watched():
        assert why_not(f"{url}/new", 5.0) == "the time for it is over"
    assert why_not(f"{url}/new", 5.0) == "", "others of this thread are not cut"
    server.shutdown()
    server.server_close()
