"""A monitor that is gone or hangs is told of by a process that is not the monitor."""

import json
import sys
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import SAID_KEY, CommandCheck, ask_alarm_list
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.tokens.names import said
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    MONITOR_STALE,
    STATISTIC,
    Alarm,
    AlarmCommand,
    Column,
    EstimateBlock,
    Event,
)
from rigwatch.wire.rig_config import SecuritySection, WitnessSection
from rigwatch.witness.doubles import RESTART, Doubles
from rigwatch.witness.kept_alarm import KeptAlarm
from rigwatch.witness.process import Witness
from rigwatch.witness.stale_alarm import StaleAlarm
from tests.bus.rig import TestRig, stopped
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually


def fault(name: str = "stale", state: str = "unacknowledged") -> Alarm:
    figures = (0.0, 0.0, 0.0)
    return Alarm(name, state, "critical", "why", "", "", 0, -1, 1, *figures, False, "", -1)  # type: ignore[arg-type]


def estimates(seq: int) -> EstimateBlock:
    return EstimateBlock("rig", 7, seq, np.zeros(1, np.int64), ())


def test_a_silent_monitor_is_an_alarm_that_clears_and_stands_in_the_list(tmp_path: Path) -> None:
    network, beat = MemoryNetwork(), tmp_path / "beat"
    monitor, screen = network.bus("r", "monitor"), network.bus("r", "dashboard")
    shown = screen.subscribe(ALARMS)
    settings = WitnessSection(heartbeat_file=str(beat))
    witness = Witness(settings, network.bus("r", "witness"), 0.0)
    said = []
    for tenth in range(40):
        if tenth < 10 or tenth >= 30:
            monitor.publish(ESTIMATES, estimates(tenth))
        witness.turn(tenth / 10, tenth * 10**8)
        said += [(one.name, one.state, tenth) for one in shown.drain()]
        if tenth == 25:
            (standing,) = ask_alarm_list(screen)
            assert standing.name == "monitor_stale"
            before = beat.read_text()
        if tenth == 29:
            assert beat.read_text() == before, "no heartbeat while nobody watches the rig"
    assert said == [
        ("monitor_stale", "unacknowledged", 20),
        ("monitor_stale", "cleared_unacknowledged", 30),
    ]
    assert beat.read_text() != before
    assert [one.state for one in ask_alarm_list(screen)] == ["cleared_unacknowledged"]


def test_a_witness_that_was_held_up_blames_the_monitor_only_if_it_stays_silent() -> None:
    network = MemoryNetwork()
    monitor, shown = network.bus("r", "monitor"), network.bus("r", "dashboard").subscribe(ALARMS)
    witness = Witness(WitnessSection(), network.bus("r", "witness"), 0.0)

    def told_at(*turns: float) -> list[float]:
        """When an alarm was raised, if the last estimate came with the first of the turns."""
        monitor.publish(ESTIMATES, estimates(0))
        found = []
        for now in turns:
            witness.turn(now, 1)
            found += [now for one in shown.drain() if one.state == "unacknowledged"]
        return found

    # What waits for a process that was paused reaches it after its next turn.
    assert told_at(0.0, 0.1, 6.0, 6.1) == []
    assert told_at(6.2, 6.3, 12.0, *(12.0 + 0.1 * tenth for tenth in range(1, 10))) == []
    assert told_at(13.0, 13.1, 19.0, 19.5, 20.0, 20.5, 21.0) == [20.0]
    # A disk that holds up each turn is no excuse.
    assert told_at(30.0, 32.0, 34.0, 36.0) == [34.0]


def test_a_rig_without_a_monitor_has_none_that_is_silent(tmp_path: Path) -> None:
    """As one on which only a structure is watched, until a monitor has been heard all the same."""
    network, kept = MemoryNetwork(), KeptAlarm(tmp_path / "alarms.jsonl.stale")
    structure, monitor = network.bus("r", "structure"), network.bus("r", "monitor")
    shown = network.bus("r", "dashboard").subscribe(ALARMS)
    kept.write(fault(MONITOR_STALE))  # of a run in which it had one
    bus = network.bus("r", "witness")
    witness = Witness(WitnessSection(), bus, 0.0, kept=kept, awaited=False)
    watched = EstimateBlock("r", 7, 0, np.zeros(1, np.int64), (Column(STATISTIC, "", np.zeros(1)),))
    for second in range(60):
        structure.publish(ESTIMATES, watched)
        witness.turn(float(second), 1)
    found = shown.drain()
    assert [(one.state, one.cause) for one in found] == [
        ("cleared_unacknowledged", "this rig has no monitor")
    ]
    monitor.publish(ESTIMATES, estimates(1))
    for tenth in range(30):
        witness.turn(60.0 + tenth / 10, 1)
    assert [one.state for one in shown.drain()] == ["unacknowledged"]


def test_a_monitor_that_is_not_heard_for_want_of_a_router_says_so() -> None:
    network = MemoryNetwork()
    witness = Witness(WitnessSection(), network.bus("r", "witness"), 0.0)
    network.up = False
    witness.turn(31.0, 1)
    network.up = True
    (standing,) = ask_alarm_list(network.bus("r", "dashboard"))
    assert standing.cause.endswith("the router does not answer")


def test_a_witness_that_is_killed_leaves_no_alarm_behind_and_hides_none(tmp_path: Path) -> None:
    network, kept = MemoryNetwork(), KeptAlarm(tmp_path / "alarms.jsonl.stale")
    monitor, page = network.bus("r", "monitor"), network.bus("r", "dashboard").subscribe(ALARMS)

    bus = network.bus("r", "witness")
    Witness(WitnessSection(), bus, 0.0, kept=kept).turn(31.0, 1)
    bus.close()  # as the kernel does for a killed one
    second = Witness(WitnessSection(), network.bus("r", "witness"), 0.0, kept=kept)
    second.turn(0.1, 2)
    assert [one.state for one in page.drain()] == ["unacknowledged"], "no estimate has come"
    monitor.publish(ESTIMATES, estimates(0))
    second.turn(0.2, 3)
    said: list[str] = []

    def told() -> bool:
        # A listener asks for the name of the second one first.
        said.extend(one.state for one in page.drain())
        return bool(said)

    eventually(told, "the end of the alarm")
    assert said == ["cleared_unacknowledged"]
    standing = kept.read()
    assert standing is not None
    assert standing.state == "cleared_unacknowledged"


def test_a_second_process_that_calls_itself_monitor_is_an_alarm_until_one_is_left() -> None:
    network, lease = MemoryNetwork(), 1.0
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "monitor")
    page = network.bus("r", "dashboard").subscribe(ALARMS)
    witness = Witness(WitnessSection(), network.bus("r", "witness"), 0.0, lease=lease)
    seconds, said = count(1), list[Alarm]()

    def passes(state: str) -> bool:
        """A second passes, in which estimates come; whether the alarm has this state."""
        now = next(seconds)
        monitor.publish(ESTIMATES, estimates(now))
        witness.turn(float(now), now * 10**9)
        said.extend(page.drain())
        return bool(said) and said[-1].state == state

    for _ in range(20):
        passes("")
    assert said == [], "one monitor"
    stranger.announce()
    began = next(seconds)
    eventually(lambda: passes("unacknowledged"), "the alarm")
    assert said[-1].name == MONITOR_STALE
    assert "2 processes call themselves monitor" in said[-1].cause
    assert said[-1].t_ns >= (began + lease + RESTART) * 10**9
    stranger.close()
    eventually(lambda: passes("cleared_unacknowledged"), "its end")
    assert len(said) == 2


@pytest.mark.long
def test_a_second_monitor_at_the_key_of_the_first_is_an_alarm_too(tmp_path: Path) -> None:
    with TestRig(tmp_path) as rig:
        rig.router()
        monitor, stranger, page = (rig.bus(name) for name in ("monitor", "monitor", "page"))
        alarms = page.listen(ALARMS)
        doubles = Doubles(rig.bus("witness"), patience=1.0)
        seconds = count(0)
        assert alarms.drain() == []

        def told() -> bool:
            return bool(doubles.text(float(next(seconds))))

        monitor.announce()
        eventually(lambda: bool(page.names(f"{SAID_KEY}/monitor")), "the monitor")
        assert not any(told() for _ in range(20))
        keys: list[str] = []

        def answers() -> bool:
            keys[:] = page.transport.tokens(page.key(f"{SAID_KEY}/monitor/*"), 1.0)
            return bool(keys)

        eventually(answers, "the key of the monitor")
        (key,) = keys
        name = f"7/1/{stranger.transport.identity}"
        ends = [
            stranger.transport.serve(key, lambda _: [said(key, name)]),
            stranger.transport.declare_token(key),
        ]
        eventually(told, "it is told")
        for end in ends:
            end()
        eventually(lambda: not told(), "one is left")
        doubles.close()


def test_a_silence_that_is_over_stands_until_somebody_has_seen_it(tmp_path: Path) -> None:
    network, secret = MemoryNetwork(), SecuritySection(secret=str(tmp_path / "secret"))
    stale = StaleAlarm(CommandCheck(network.bus("r", "monitor"), secret))
    ann = network.bus("r", "ann", signer_of(secret, ""))
    command = signed(ann, AlarmCommand(MONITOR_STALE, "acknowledge", "ann", 3))
    said = [*stale.judge(True, 1.1, 1, lambda: "no router"), *stale.judge(False, 0.0, 2)]
    said += [*stale.judge(False, 0.0, 3)]
    assert [one.state for one in said] == ["unacknowledged", "cleared_unacknowledged"]
    assert said[0].cause.endswith("for 1.1 s; no router")
    assert [one.state for one in stale.judge(True, 1.1, 4)] == ["unacknowledged"]
    assert [one.state for one in stale.judge(False, 0.0, 5)] == ["cleared_unacknowledged"]
    assert [getattr(one, "state", one) for one in stale.command(command, 6)] == ["normal"]
    assert stale.standing is None
    assert list(stale.judge(False, 0.0, 7)) == []


def test_a_forged_command_is_refused_and_counted_also_where_no_alarm_stands(tmp_path: Path) -> None:
    network, secret = MemoryNetwork(), SecuritySection(secret=str(tmp_path / "secret"))
    check = CommandCheck(network.bus("r", "witness"), secret)
    (said,) = StaleAlarm(check).command(AlarmCommand(MONITOR_STALE, "acknowledge", "eve", 1), 2)
    assert isinstance(said, Event)
    assert "it is not signed" in said.text
    assert check.refused == 1


def test_a_hung_monitor_is_reported_by_the_witness_and_the_command_is_run(tmp_path: Path) -> None:
    told = tmp_path / "told"
    line = "sys.argv[1] + ' ' + sys.stdin.read() + chr(10)"
    code = f"import sys; open({str(told)!r}, 'a').write({line})"
    command = ", ".join(map(json.dumps, (sys.executable, "-c", code)))
    section = f"\n[witness]\nnotify = [{command}]\n"
    with TestRig(tmp_path, monitor_section(tmp_path) + section) as rig:
        rig.router()
        observer = rig.bus("observer")
        alarms, judged = observer.subscribe(ALARMS), observer.subscribe(ESTIMATES)
        monitor = rig.start("-m", "rigwatch", "monitor", str(rig.path))
        rig.start("-m", "rigwatch", "witness", str(rig.path))
        eventually(
            lambda: {"alive/monitor", "alive/witness"} <= set(observer.tokens("alive/*")), "both"
        )
        rig.publisher(5, "--wave")
        eventually(lambda: len(judged.drain()) > 0, "estimates come")
        found: list[tuple[str, str]] = []

        def said(state: str) -> bool:
            found.extend((one.name, one.state) for one in alarms.drain())
            return ("monitor_stale", state) in found

        with stopped(monitor):
            eventually(lambda: said("unacknowledged"), "the alarm")
        eventually(lambda: said("cleared_unacknowledged"), "its end")
        eventually(lambda: told.exists() and "monitor_stale" in told.read_text(), "the command")
        found_line = next(
            one for one in told.read_text().splitlines() if one.startswith("monitor_stale")
        )
        assert json.loads(found_line.partition(" ")[2])["severity"] == "critical"
