"""A monitor that is killed while the router is away: nobody has heard what it said meanwhile."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.alarms import read_journal
from rigwatch.wire.messages import Alarm, Gap
from rigwatch.wire.session import open_session
from tests.faults.field import Field
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("faults-supervised")
BOOT = 5
Change = tuple[str, str, int]


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Field]:
    recorder = f'[recorder]\nfolder = "{tmp_path}/sessions"\n'
    with Field(tmp_path, 'adapter = "serial"\nport = "/dev/null"', extra=recorder) as made:
        made.start("monitor", "record")
        made.rig.publisher(BOOT, "--wave")
        made.judged(BOOT, 64)
        yield made


def change_of(alarm: Alarm) -> Change:
    return alarm.name, alarm.state, alarm.t_ns


def changes(rig: Field, since_ns: int) -> list[Change]:
    """The changes of state in the journal since a moment."""
    states: dict[str, str] = {}
    found = []
    for one in read_journal(rig.journal)[0]:
        alarm = one.alarm
        if states.get(alarm.name, "normal") != alarm.state and alarm.t_ns >= since_ns:
            found.append(change_of(alarm))
        states[alarm.name] = alarm.state
    return found


def recorded(rig: Field) -> list[Alarm | Gap]:
    folders = sorted((rig.folder / "sessions").glob("*Z*"))
    messages = [
        one.message for f in folders for one in open_session(f).messages(["alarms", "gaps"])
    ]
    return [one for one in messages if isinstance(one, Alarm | Gap)]


def lost(messages: list[Alarm | Gap] | list[Gap]) -> list[Gap]:
    return [one for one in messages if isinstance(one, Gap) and one.topic == "alarms"]


@pytest.mark.parametrize("dead", [("monitor",), ("monitor", "record")], ids=" and ".join)
def test_62_a_monitor_that_is_killed_while_the_router_is_away(
    rig: Field, dead: tuple[str, ...]
) -> None:
    began = time.time_ns()
    rig.kill("router")
    eventually(lambda: not rig.bus.connected(), "the router is missed")
    rig.raised("link", after_ns=began)
    rig.raised("stale", after_ns=began)
    for command in dead:
        rig.kill(command)
    said = changes(rig, began)
    assert said, "in the journal, and heard by nobody"
    assert not {change_of(one) for one in rig.alarms} & set(said)
    rig.processes["router"] = rig.rig.router()
    rig.start(*dead)
    back = time.monotonic()
    eventually(lambda: set(said) <= {change_of(one) for one in rig.alarms}, "all are heard")
    assert time.monotonic() - back < 5.0
    rig.cleared("link")
    last = [change_of(one.alarm) for one in rig.journalled("link")][-1]
    eventually(lambda: last in [change_of(one) for one in rig.alarms], "and what followed")
    heard = [change_of(one) for one in rig.alarms]
    eventually(
        lambda: last in [change_of(a) for a in recorded(rig) if isinstance(a, Alarm)], "on disk"
    )
    kept = recorded(rig)
    in_file = [change_of(one) for one in kept if isinstance(one, Alarm)]
    for change in said:
        assert (heard.count(change), in_file.count(change)) == (1, 1), change
    assert [one for one in heard if one in said] == said, "in their order"
    assert lost(rig.gaps) == lost(kept) == []
