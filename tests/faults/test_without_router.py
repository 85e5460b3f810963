"""Processes without a router.

Those that wait for one at their start say so, and end at once at a signal. What a monitor says and
takes with it as it is killed, the next one delivers.
"""

import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from shutil import copy

import pytest

from monitor.alarms import read_journal
from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.host.ports import free_port
from rigwatch.wire.messages import Alarm, Gap
from rigwatch.wire.session import open_session
from rigwatch.wire.typed_files.shipped import find_config
from tests.faults.field import Field
from tests.waiting import eventually

MODEL = Path(__file__).parents[1] / "versions" / "2026-11-22" / "model.toml"
AT_ONCE = 2.0
"""Time to end, an attempt of the bus and the interpreter's own end included [s]."""
BOOT = 5
PROCESSES = ("daq", "monitor", "record", "witness", "dashboard")
Change = tuple[str, str, int]


def alone(folder: Path) -> Path:
    """The demonstration's rig, on a bus that nobody serves."""
    copy(MODEL, folder)
    rig = write_rig_file(find_config("demo.toml"), folder, "web")
    rig.write_text(
        re.sub(r'"tcp/127.0.0.1:\d+"', f'"tcp/127.0.0.1:{free_port()}"', rig.read_text())
        + "\n[witness]\n"
    )
    return rig


@pytest.mark.parametrize(
    ("process", "number"),
    [
        *((process, signal.SIGTERM) for process in PROCESSES),
        ("record", signal.SIGINT),
        *(
            pytest.param(process, signal.SIGINT, marks=pytest.mark.nightly)
            for process in PROCESSES
            if process != "record"
        ),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_a_process_that_waits_for_its_router_ends_at_once(
    process: str, number: signal.Signals, tmp_path: Path
) -> None:
    said: list[str] = []
    command = [sys.executable, "-m", "rigwatch", process, str(alone(tmp_path))]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as running:
        assert running.stdout is not None
        reader = threading.Thread(target=said.extend, args=(running.stdout,))
        reader.start()
        eventually(lambda: bool(said), "it says so")
        assert "no router answers" in said[0]
        asked = time.monotonic()
        running.send_signal(number)
        try:
            code = running.wait(timeout=10 * AT_ONCE)
        finally:
            running.kill()
        took = time.monotonic() - asked
        reader.join()
    assert code == 0, said
    assert took < AT_ONCE
    assert len(said) == 1, said


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


@pytest.mark.xdist_group("faults-supervised")
@pytest.mark.parametrize(
    "dead",
    [pytest.param(("monitor",), marks=pytest.mark.nightly), ("monitor", "record")],
    ids=" and ".join,
)
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
