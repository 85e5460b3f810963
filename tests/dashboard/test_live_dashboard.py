"""The dashboard process over a real router: it shows the rig, and its death hurts nobody."""

import contextlib
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from rigwatch.dashboard.board import palette
from rigwatch.dashboard.feed import Feed
from rigwatch.dashboard.viewer.viewer import answers
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.alarm_list import serve_alarm_list
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.bus.subscription import Subscription
from rigwatch.wire.bus.zenoh_transport import open_router
from rigwatch.wire.host.ports import free_port
from rigwatch.wire.messages.message_types import Alarm, Event, Message, SampleBlock
from rigwatch.wire.messages.topics import EVENTS, HEALTH, SAMPLES, topic_of
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.dashboard.rig_messages import RATE, Rig
from tests.dashboard.screen import Screen
from tests.waiting import eventually

pytestmark = pytest.mark.long

CONFIG = """
[rig]
id = "bench"
[bus]
router = "tcp/127.0.0.1:{bus}"
listen = "tcp/127.0.0.1:{bus}"
[[channels]]
name = "voltage"
unit = "V"
gain = 1e-3
[daq.device]
adapter = "serial"
port = "unused"
[dashboard]
grpc_port = {grpc}
web_port = {web}
update_rate = 8.0
"""


@pytest.fixture(scope="module")
def config_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    path.write_text(CONFIG.format(bus=free_port(), grpc=free_port(), web=free_port()))
    return path


@pytest.fixture(scope="module")
def config(config_file: Path) -> RigConfig:
    return load_rig(config_file)


@pytest.fixture(scope="module")
def bus(config: RigConfig) -> Iterator[Bus]:
    close = open_router(config.bus.listen)
    bus = connect(config, "rig", timeout=10)
    yield bus
    bus.close()
    close()


class Player(threading.Thread):
    """Says a rig's messages on the bus in real time, and tells who asks which alarms stand."""

    def __init__(self, bus: Bus, rig: Rig) -> None:
        super().__init__(daemon=True)
        self.bus, self.rig = bus, rig
        self.stopped = threading.Event()
        self.sent = 0
        self.standing: dict[str, Alarm] = {}

    def run(self) -> None:
        began = time.monotonic()
        for message in self.rig.messages(600.0):
            if isinstance(message, SampleBlock):
                due = began + (message.seq + len(message)) / RATE
                if self.stopped.wait(max(0.0, due - time.monotonic())):
                    return
                self.sent += len(message)
            if isinstance(message, Alarm):
                self.standing[message.name] = message
            self.bus.publish(topic_of(message), message)

    def alarms(self) -> list[Alarm]:
        return [alarm for alarm in self.standing.values() if alarm.state != "normal"]


@contextlib.contextmanager
def playing(bus: Bus) -> Iterator[Player]:
    player = Player(bus, Rig(friction_at=2.0, start_ns=time.time_ns()))
    close = serve_alarm_list(bus, player.alarms)
    player.start()
    try:
        yield player
    finally:
        close()
        player.stopped.set()
        player.join()


@contextlib.contextmanager
def dashboard(config_file: Path, viewer: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "rigwatch", "dashboard", str(config_file), "--viewer", viewer]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(10)
        process.kill()


def test_the_screen_shows_the_rig_and_its_friction(
    bus: Bus, config_file: Path, config: RigConfig
) -> None:
    assert config.dashboard is not None
    port = config.dashboard.grpc_port
    with dashboard(config_file, "headless") as process, playing(bus):
        eventually(lambda: answers(port) or process.poll() is not None, "the viewer answers")
        screen = Screen(f"rerun+http://127.0.0.1:{port}/proxy")
        eventually(lambda: red_verdict(screen), "the verdict turns red")
        end = screen.timeline_end()
        eventually(lambda: screen.timeline_end() - end > 1.5e9, "time goes on")
        check_views(screen)
        check_colours(screen)
        assert screen.errors() == []
        process.send_signal(signal.SIGTERM)
        assert process.wait(15) == 0
        eventually(lambda: not answers(port), "the viewer ends with the dashboard")


def test_it_may_die_and_so_may_its_viewer(bus: Bus, config_file: Path, config: RigConfig) -> None:
    assert config.dashboard is not None
    port = config.dashboard.grpc_port
    listener, health = bus.subscribe(SAMPLES), bus.subscribe(HEALTH)
    with dashboard(config_file, "headless") as process, playing(bus) as player:
        eventually(
            lambda: shows(health) or process.poll() is not None, "the dashboard shows the rig"
        )
        viewer = psutil.Process(process.pid).children()[0]
        viewer.kill()
        assert process.stderr is not None
        assert "has died and is opened again" in process.stderr.readline()
        eventually(lambda: new_viewer(process.pid, viewer.pid) and answers(port), "a new viewer")
        screen = Screen(f"rerun+http://127.0.0.1:{port}/proxy")
        eventually(lambda: red_verdict(screen), "the new viewer shows the verdict")
        process.kill()
        eventually(lambda: not answers(port), "the viewer ends with a killed dashboard")
        sent = player.sent
        eventually(lambda: player.sent > sent + 128, "the rig goes on")
    blocks = listener.drain()
    assert [block.seq for block in blocks] == list(range(0, player.sent, 8))[: len(blocks)]
    assert len(blocks) * 8 >= player.sent - 8


def test_a_late_screen_knows_the_alarms_that_stand(bus: Bus) -> None:
    rig = Rig()
    standing = rig.alarm("dry_friction", "unacknowledged", 5000, "dry friction")
    close = serve_alarm_list(bus, lambda: [standing])
    assert [alarm.name for alarm in Feed(bus).standing()] == ["dry_friction"]
    close()
    assert Feed(bus).standing() == []


def test_what_a_client_dates_ahead_is_drawn_now(bus: Bus) -> None:
    feed, now = Feed(bus), time.time_ns()
    ahead = now + 50 * 365 * 86_400 * 10**9  # the screen would follow it, and be empty
    bus.publish(EVENTS, Event("eve", ahead, "info", "X", ""))
    bus.publish(EVENTS, Event("eve", now - 10**9, "info", "Y", ""))
    found: list[Message] = []
    eventually(lambda: (found.extend(feed.drain()), len(found) == 2)[1], "both events")
    feed.close()
    assert [one.code for one in found if isinstance(one, Event)] == ["X", "Y"]
    late, old = (one.t_ns for one in found if isinstance(one, Event))
    assert now <= late <= time.time_ns()
    assert old == now - 10**9


def shows(health: Subscription) -> bool:
    """Whether the dashboard has said that it runs, which it does once its viewer is open."""
    return any(message.source == "dashboard" for message in health.drain())


def new_viewer(dashboard: int, old: int) -> bool:
    return any(child.pid != old for child in psutil.Process(dashboard).children())


def red_verdict(screen: Screen) -> bool:
    if "Verdict" not in screen.views():
        return False
    return screen.lane("Verdict", palette.VERDICTS["dry_friction"][1]).pixels > 200


def check_views(screen: Screen) -> None:
    expected = {
        "Verdict",
        "What to do",
        "Status",
        "Alarms over time",
        "Alarm log",
        "Servo voltage [V]",
        "Position [mm]",
        "Acceleration, measured and modelled [m/s²]",
        "Residual acceleration and its change, with limits [m/s²]",
        "Coulomb friction θ1 with thresholds and signature",
        "Viscous friction θ2 with thresholds and signature",
        "Rates [Hz]",
    }
    assert expected <= set(screen.views())
    assert screen.reports() == []


def check_colours(screen: Screen) -> None:
    for title, colour in (
        ("Servo voltage [V]", palette.VOLTAGE),
        ("Position [mm]", palette.POSITION),
        ("Acceleration, measured and modelled [m/s²]", palette.ACCELERATION),
        ("Acceleration, measured and modelled [m/s²]", palette.MODEL),
        ("Residual acceleration and its change, with limits [m/s²]", palette.CHANGE),
        ("Residual acceleration and its change, with limits [m/s²]", palette.LIMIT),
    ):
        patch = screen.patch(title, colour)
        assert patch.pixels > 300, (title, patch)
        assert patch.spread > 0.5, (title, patch)
    for title, colour in (
        ("Coulomb friction θ1 with thresholds and signature", palette.THETA1),
        ("Viscous friction θ2 with thresholds and signature", palette.THETA2),
    ):
        assert screen.patch(title, colour).pixels > 60, title
    assert screen.lane("Alarms over time", palette.STATES["unacknowledged"][1]).pixels > 100
    assert screen.lane("Alarms over time", palette.STATES["normal"][1]).pixels > 100
