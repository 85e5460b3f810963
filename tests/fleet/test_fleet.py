"""Many rigs at a glance: the worst first, and a rig that does not answer is one of them."""

import json
import threading
import time
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.fleet import Fleet, as_lines, as_page, fleet
from rigwatch.fleet.fleet import Onlooker
from rigwatch.fleet.rig_state import GONE, UNREACHABLE, judged
from rigwatch.wire.bus import Bus, connect, serve_alarm_list
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import HEALTH, MOST_SOURCES, Alarm, Health
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import TestRig, kill, stopped
from tests.monitor_process.test_several import rig_file
from tests.waiting import PATIENCE, eventually

NAN = float("nan")


def alarm(name: str, severity: str, state: str = "unacknowledged", at: int = 1) -> Alarm:
    text = ("<rubs>", "stop & look")
    return Alarm(name, state, severity, *text, "rig", 1, 0, at, NAN, NAN, NAN, True, "", 0)


def test_what_is_worse_comes_first():
    well = {"monitor": Health("monitor", 1, "running", "", {"lost_samples": 0.0})}
    ill = {"daq": Health("daq/rig", 1, "reconnecting", "", {})}
    info, error, seen = alarm("a", "info"), alarm("b", "error"), alarm("c", "error", "acknowledged")
    cases = [
        judged("1", "x", (), (), well),
        judged("2", "x", (), (), ill),
        judged("3", "x", (), (info,), well),
        judged("4", "x", (), (info, seen), well),
        judged("5", "x", (), (seen, error), well),
        judged("6", "x", (), (alarm("d", "critical"),), well),
        judged("7", "x", ("daq",), (), well),
    ]
    ranks = [case.rank for case in cases]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) == len(ranks)
    assert ranks[0] == 0
    assert [case.state for case in cases[4:]] == ["b", "d", "daq not there"]


def test_a_page_has_a_section_for_each_rig_and_escapes_what_rigs_say():
    state = judged("a b", "my rig.toml", (), (alarm("dry_friction", "error"),), {})
    page = as_page([state])
    assert 'href="#rig-a%20b"' in page
    assert 'id="rig-a%20b"' in page
    assert "&lt;rubs&gt; stop &amp; look" in page
    assert "rigwatch dashboard &#39;my rig.toml&#39;" in page


def test_processes_that_are_made_up_are_bounded_and_those_of_the_rig_are_heard(tmp_path: Path):
    network = MemoryNetwork()
    bus, stranger = network.bus("r", "fleet"), network.bus("r", "stranger")
    onlooker = Onlooker(tmp_path, load_rig(TestRig(tmp_path).path), 0.1)
    onlooker._bus, onlooker._healths = bus, bus.subscribe(HEALTH)
    for number in range(3 * MOST_SOURCES):
        stranger.publish(HEALTH, Health(f"p{number}", 1, "running", "", {}))
    onlooker.state()
    daq = network.bus("r", "daq")  # it begins late
    daq.publish(HEALTH, Health("daq/rig", 1, "reconnecting", "", {}))
    assert onlooker.state().state == "daq/rig: reconnecting"
    assert len(onlooker._last) == MOST_SOURCES + 1


@pytest.mark.parametrize("seen_away", [False, True])
def test_a_process_that_has_just_come_back_does_not_hang(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seen_away: bool
):
    monkeypatch.setattr(fleet, "SILENT_S", 0.3)
    network = MemoryNetwork()
    onlooker = Onlooker(tmp_path, load_rig(TestRig(tmp_path).path), 2.0)
    monkeypatch.setattr(fleet, "connect", lambda *_: network.bus("r", "fleet"))
    well = Health("daq/rig", 1, "running", "", {})
    daq = network.bus("r", "daq")
    threading.Timer(0.1, lambda: daq.publish(HEALTH, well)).start()
    assert onlooker.state().hung == ()
    daq.close()
    if seen_away:
        assert onlooker.state().missing == ("daq",)
    time.sleep(0.5)
    daq = network.bus("r", "daq")
    threading.Timer(0.2, lambda: daq.publish(HEALTH, well)).start()
    state = onlooker.state()
    assert (state.hung, state.missing) == ((), ())
    eventually(lambda: onlooker.state().hung == ("daq",), "it has said nothing since")


def test_a_monitor_that_does_not_tell_its_alarms_is_not_one_without_alarms(tmp_path: Path):
    config, network = load_rig(rig_file(tmp_path, "r")), MemoryNetwork()
    processes = {name: network.bus("r", name) for name in ("daq", "monitor", "recorder", "witness")}
    onlooker = Onlooker(tmp_path, config, 0.1)
    onlooker._bus = network.bus("r", "fleet")
    onlooker._healths = onlooker._bus.subscribe(HEALTH)
    for name, bus in processes.items():
        bus.publish(HEALTH, Health(name, 1, "running", "", {}))
    mute = onlooker.state()
    assert (mute.missing, mute.hung) == ((), ())
    assert (mute.rank, mute.state) == (GONE, "monitor does not tell its alarms")
    standing = [alarm("dry_friction", "error")]
    serve_alarm_list(processes["monitor"], lambda: standing)
    assert onlooker.state().state == "dry_friction"
    standing.clear()
    assert (onlooker.state().rank, onlooker.state().state) == (0, "runs")


def test_a_rig_whose_keys_cannot_be_read_hides_no_other(tmp_path: Path):
    paths = [rig_file(tmp_path, "plain"), rig_file(tmp_path, "keyed")]
    text = paths[1].read_text().replace("tcp/", "tls/")
    paths[1].write_text(f'{text}\n[bus.security]\nkeys = "{tmp_path}/none"\n')
    fleet = Fleet(paths, timeout=0.2)
    states = {state.rig: state for state in fleet.states()}
    fleet.close()
    assert "no router answers" in states["plain"].state
    assert states["keyed"].rank == UNREACHABLE
    assert "no such file; `rigwatch keys issue" in states["keyed"].state


@pytest.fixture
def rigs(tmp_path: Path):
    """A rig that runs, one whose daq is not there, and one without a router."""
    with TestRig(tmp_path) as base:
        base.router()
        paths = [rig_file(tmp_path, name, base.listen) for name in ("runs", "stands")]
        paths.append(rig_file(tmp_path, "away"))
        monitor = base.start("-m", "rigwatch", "monitor", *map(str, paths[:2]))
        base.publisher(1, "--wave", path=paths[0])
        bus = base.bus("observer", load_rig(paths[1]))
        eventually(lambda: "alive/monitor" in bus.tokens("alive/*"), "the monitor")
        yield paths, monitor


def test_the_fleet_is_seen_and_a_rig_that_goes_moves_up(rigs, tmp_path, capsys):
    paths, monitor = rigs
    fleet = Fleet(paths, timeout=5.0)
    eventually(lambda: fleet.states()[-1].figures["samples"] > 0, "the first samples")
    away, stands, runs = fleet.states()
    fleet.close()
    assert (away.rig, away.rank) == ("away", UNREACHABLE)
    assert "no router answers" in away.state
    assert (stands.rig, stands.rank, stands.missing) == ("stands", GONE, ("daq",))
    assert runs.rig == "runs"
    assert runs.rank < GONE
    assert as_lines([away, stands, runs])[-1].startswith("3 rigs: ")
    page = tmp_path / "fleet.html"
    words = ["fleet", *map(str, paths[:2]), "--json", "--page", str(page)]
    assert main(words) == 1
    assert [one["rig"] for one in json.loads(capsys.readouterr().out)] == ["stands", "runs"]
    assert "rig-runs" in page.read_text()
    one = Fleet(paths[:1], timeout=5.0)
    assert one.states()[0].rank < GONE
    with stopped(monitor):
        eventually(lambda: one.states()[0].hung == ("monitor",), "the rig's monitor hangs")
        (state,) = Fleet(paths[:1], timeout=5.0).states()
        assert (state.hung, state.missing) == (("monitor",), ())
        assert state.state == "monitor hangs: no sign of life"
        bus = base_bus(paths[0])
        eventually(lambda: "alive/monitor" not in bus.tokens("alive/*"), "the router's patience")
        assert one.states()[0].hung == ("monitor",)
        bus.close()
    eventually(lambda: not one.states()[0].hung, "the monitor goes on")
    kill(monitor)
    eventually(lambda: one.states()[0].missing == ("monitor",), "the rig lacks its monitor")
    assert one.states()[0].hung == ()
    one.close()


def base_bus(path: Path) -> Bus:
    """A place on the bus of a rig."""
    return connect(load_rig(path), "onlooker", PATIENCE)


def test_one_rig_named_twice_is_refused(tmp_path):
    path = rig_file(tmp_path, "a")
    twin = tmp_path / "twin.toml"
    twin.write_text(path.read_text())
    with pytest.raises(ConfigError, match=r"rig.id: found the same as in .*rig.toml"):
        Fleet([path, twin], 1.0)


def test_a_wrong_configuration_hides_no_other_rig_and_joins_when_it_is_mended(tmp_path):
    (tmp_path / "rig").mkdir()
    right, wrong = rig_file(tmp_path / "rig", "a"), tmp_path / "wrong.toml"
    wrong.write_text("rubbish = [")
    fleet = Fleet([right, wrong], 0.1)
    a, b = fleet.states()
    assert (a.rig, b.rig) == ("a", "wrong.toml")
    assert b.state.startswith(f"{wrong}: found ")
    wrong.write_text(right.read_text().replace('id = "a"', 'id = "b"'))
    assert [state.rig for state in fleet.states()] == ["a", "b"]
    fleet.close()
    with pytest.raises(ConfigError, match="no such file"):
        Fleet([tmp_path / "none.toml"], 0.1)
