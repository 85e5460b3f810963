"""The monitor's process on a bus in memory: what it says to samples, gaps, commands and silence."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from monitor.alarms import Occasion
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.process.key_watch import KeyWatch
from monitor.process.link_watch import LinkWatch, Seen
from monitor.process.loop import MonitorProcess, suitable_model
from rigwatch.wire.access import REGISTER, Issued, Register, signer_of
from rigwatch.wire.bus.commands import alarm_command, taken_at
from rigwatch.wire.bus.commands.alarm_command import CommandAnswer, command_alarms
from rigwatch.wire.bus.commands.alarm_list import ask_alarm_list, serve_alarm_list
from rigwatch.wire.bus.commands.command_check import command_mark, signed
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.subscription import Subscription
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.errors import BusError, ConfigError
from rigwatch.wire.messages.blocks import concatenate
from rigwatch.wire.messages.message_types import (
    AlarmCommand,
    EstimateBlock,
    Health,
    SampleBlock,
)
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.messages.topics import (
    ALARMS,
    COMMANDS,
    ESTIMATES,
    EVENTS,
    HEALTH,
    SAMPLES,
    Topic,
)
from rigwatch.wire.rig_config import load_rig
from tests.bus.publisher import wave
from tests.bus.rig import PATIENCE, TestRig
from tests.monitor_process.model import MODEL, monitor_section
from tests.waiting import eventually, wait_until


class Bench:
    """A monitor whose loop is turned by hand, and a source of samples."""

    def __init__(self, folder: Path) -> None:
        rig = TestRig(folder, monitor_section(folder))
        self.path, self.config = rig.path, rig.config
        self.network = MemoryNetwork()
        self.daq = self.network.bus("bench", "daq")
        security = self.config.bus.security
        self.observer = self.network.bus("bench", "observer", signer_of(security, ""))
        self.ring = SampleRing(self.daq, 65536)
        self.heard = {t: self.observer.subscribe(t) for t in (ESTIMATES, ALARMS, EVENTS, HEALTH)}
        self.start()

    def start(self) -> None:
        bus = self.network.bus("bench", "monitor")
        self.monitor = MonitorProcess(
            self.config, self.path, suitable_model(self.config, self.path), bus
        )
        self.bus = bus

    def kill(self) -> None:
        """What a kill -9 leaves: nothing is closed or said, and the kernel frees the lock."""
        self.bus.close()
        if self.monitor._alone:
            self.monitor._alone.give_up()

    def send(self, block: SampleBlock, *, kept_back: bool = False) -> None:
        self.ring.add(block)
        if not kept_back:
            self.daq.publish(SAMPLES, block)

    def turn(self) -> None:
        for item in self.monitor.reader.read(0.0):
            self.monitor.take(item)
        self.monitor.keep_position()
        self.monitor.look_around()

    def turn_until(self, seq: int) -> None:
        """Turn the loop until the monitor has dealt with the sample `seq`."""

        def done() -> bool:
            self.turn()
            position = self.monitor.reader.position
            return position is not None and position[1] >= seq

        assert wait_until(done, PATIENCE, 0.001)

    def got(self, topic: Topic) -> list[object]:
        return list(self.heard[topic].drain())

    def alarm_states(self) -> list[tuple[str, str]]:
        drained = self.heard[ALARMS].drain()
        return [(alarm.name, alarm.state) for alarm in drained]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.monitor.close()


def estimates_of(subscription: Subscription) -> EstimateBlock:
    return concatenate(subscription.drain())


def same(first: EstimateBlock, second: EstimateBlock) -> bool:
    return encode(first) == encode(second)


def test_what_is_published_is_what_the_pipeline_says_to_the_last_bit(bench: Bench) -> None:
    blocks = [wave(seq, 1 + seq % 3, 7, 0) for seq in _starts(600)]
    for block in blocks:
        bench.send(block)
        bench.turn()
    replayed = [RigMonitor(MODEL).update(concatenate(blocks))]
    assert replayed[0] is not None
    assert same(estimates_of(bench.heard[ESTIMATES]), replayed[0].estimates)


def _starts(count: int) -> list[int]:
    starts = [0]
    while starts[-1] < count:
        starts.append(starts[-1] + 1 + starts[-1] % 3)
    return starts


def test_samples_that_the_bus_lost_are_judged_in_order_all_the_same(bench: Bench) -> None:
    for seq in range(300):
        bench.send(wave(seq, 1, 7, 0), kept_back=100 <= seq < 150)
        bench.turn()
    bench.turn_until(299)
    blocks = bench.heard[ESTIMATES].drain()
    assert [b.seq for b in blocks] == list(np.cumsum([0] + [len(b) for b in blocks[:-1]]))
    assert blocks[-1].seq + len(blocks[-1]) == 300


def test_an_estimate_leaves_in_the_same_turn_as_its_sample_came(bench: Bench) -> None:
    for seq in range(20):
        bench.send(wave(seq, 1, 7, 0))
        bench.turn()
        assert [b.seq for b in bench.heard[ESTIMATES].drain()] == [seq]


def test_one_that_is_behind_judges_merged_blocks(bench: Bench) -> None:
    for seq in range(1500):
        bench.send(wave(seq, 1, 7, 0))
    bench.turn()
    blocks = bench.heard[ESTIMATES].drain()
    assert sum(len(block) for block in blocks) == 1500
    assert len(blocks) == 3


def test_silence_is_an_alarm_that_samples_clear(bench: Bench) -> None:
    bench.send(wave(0, 1, 7, 0))
    bench.turn()

    def stale() -> bool:
        bench.turn()
        return ("stale", "unacknowledged") in bench.alarm_states()

    assert wait_until(stale, PATIENCE)
    bench.send(wave(1, 1, 7, 0))
    bench.turn()
    assert ("stale", "cleared_unacknowledged") in bench.alarm_states()


def test_a_daq_that_is_gone_is_named(bench: Bench) -> None:
    bench.send(wave(0, 1, 7, 0))
    bench.turn()
    bench.daq.close()

    def named() -> bool:
        bench.turn()
        return ("link", "unacknowledged") in bench.alarm_states()

    assert wait_until(named, PATIENCE)
    standing = {alarm.name: alarm for alarm in ask_alarm_list(bench.observer)}
    assert "the daq process is not there" in standing["link"].cause


def test_a_router_that_is_away_is_named_as_the_reason(bench: Bench) -> None:
    bench.send(wave(0, 1, 7, 0))
    bench.turn()
    bench.network.up = False
    bench.daq.close()

    def named() -> bool:
        bench.turn()
        return "link" in {one.name for one in bench.monitor.rig.alarms.standing()}

    assert wait_until(named, PATIENCE)
    standing = {one.name: one for one in bench.monitor.rig.alarms.standing()}
    link = standing["link"]
    assert link.cause.endswith(": the router does not answer")
    # What does not depend on the reason accuses no cable.
    assert "cable" not in link.cause
    assert "router" in link.guidance


def test_commands_are_obeyed_and_refusals_explained(bench: Bench) -> None:
    bench.send(wave(0, 1, 7, 0))
    bench.turn()
    at = Occasion("rig", 7, 0, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    assert [a.name for a in ask_alarm_list(bench.observer)] == ["disk"]
    command = AlarmCommand("disk", "acknowledge", "ann", time.time_ns())
    bench.observer.publish(COMMANDS, signed(bench.observer, command))
    bench.turn()
    assert ("disk", "acknowledged") in bench.alarm_states()
    unknown = AlarmCommand("dsk", "reset", "ann", time.time_ns())
    bench.observer.publish(COMMANDS, signed(bench.observer, unknown))
    bench.turn()
    codes = [event.code for event in bench.heard[EVENTS].drain()]
    assert "alarm_command_refused" in codes


def test_where_a_command_was_taken_is_told(bench: Bench) -> None:
    bench.send(wave(0, 4, 7, 0))
    bench.turn()
    at = Occasion("rig", 7, 0, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    years_ahead = AlarmCommand("disk", "acknowledge", "ann", time.time_ns() + 10**18)
    sent = signed(bench.observer, years_ahead)
    bench.observer.publish(COMMANDS, sent)
    bench.turn()
    (place,) = filter(None, map(taken_at, bench.heard[EVENTS].drain()))
    assert (place.mark, place.boot, place.seq) == (command_mark(sent), 7, 3)
    assert abs(place.t_ns - time.time_ns()) < 60e9, "the monitor's time, not the operator's"
    stranger = replace(sent, user="eve")
    bench.observer.publish(COMMANDS, stranger)
    bench.turn()
    assert not any(map(taken_at, bench.heard[EVENTS].drain())), "refused, and not taken"


def test_of_two_operators_at_once_one_is_obeyed_and_only_the_other_is_refused(
    bench: Bench,
) -> None:
    bench.send(wave(0, 1, 7, 0))
    bench.turn()
    at = Occasion("rig", 7, 0, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    answers: dict[str, CommandAnswer] = {}

    def acknowledge(user: str) -> None:
        signer = signer_of(bench.config.bus.security, "")
        bus = bench.network.bus("bench", user, signer)
        answers[user] = command_alarms(bus, AlarmCommand("disk", "acknowledge", user, 1))

    users = [threading.Thread(target=acknowledge, args=(user,)) for user in ("ann", "bob")]
    for user in users:
        user.start()
    eventually(lambda: len(bench.monitor._operators._commands) == 2, "both commands")
    bench.turn()
    for user in users:
        user.join()
    obeyed = {user for user, answer in answers.items() if answer.changed}
    refused = {user: one.refusal for user, one in answers.items() if one.refusal}
    assert len(obeyed) == 1
    assert refused.keys() == {"ann", "bob"} - obeyed
    assert [*refused.values()] == ["acknowledge of disk refused: it is acknowledged"]


def test_a_command_that_dies_with_its_monitor_reaches_the_next_or_is_told(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(alarm_command, "TIMEOUT", 0.6)
    at = Occasion("rig", 7, 0, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    told: list[object] = []

    def acknowledge() -> None:
        try:
            told.append(
                command_alarms(bench.observer, AlarmCommand("disk", "acknowledge", "ann", 1))
            )
        except BusError as error:
            told.append(str(error))

    def sent() -> threading.Thread:
        thread = threading.Thread(target=acknowledge)
        thread.start()
        eventually(lambda: len(bench.monitor._operators._commands) == 1, "the command")
        bench.kill()
        return thread

    waiting = sent()
    # A witness answers for the list of alarms too, and executes none of the monitor's.
    serve_alarm_list(bench.network.bus("bench", "witness"), list)
    waiting.join()
    assert told == ["no monitor of rig bench answers: start `rigwatch monitor`"]
    bench.start()
    waiting = sent()
    bench.start()
    assert wait_until(lambda: bench.turn() or not waiting.is_alive(), PATIENCE)
    answer = told[1]
    assert isinstance(answer, CommandAnswer)
    assert ([one.state for one in answer.changed], answer.refusal) == (["acknowledged"], "")


def test_a_killed_monitor_has_its_alarms_and_misses_no_sample(bench: Bench) -> None:
    for seq in range(400):
        bench.send(wave(seq, 1, 7, 0))
    bench.turn_until(399)
    at = Occasion("rig", 7, 399, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    before = estimates_of(bench.heard[ESTIMATES])
    bench.kill()
    for seq in range(400, 700):
        bench.send(wave(seq, 1, 7, 0))
    heard_before = bench.alarm_states()
    late = bench.network.bus("bench", "late").subscribe(ALARMS)
    bench.start()
    told: list[tuple[str, str]] = []

    def tells() -> bool:
        told.extend((alarm.name, alarm.state) for alarm in late.drain())
        return ("disk", "unacknowledged") in told

    assert wait_until(tells, PATIENCE), "to one that has come meanwhile"
    bench.send(wave(700, 1, 7, 0))
    bench.turn_until(700)
    heard: list[EstimateBlock] = []

    def all_heard() -> bool:
        heard.extend(bench.heard[ESTIMATES].drain())
        return bool(heard) and heard[-1].seq + len(heard[-1]) > 700

    assert wait_until(all_heard, PATIENCE)
    after = concatenate(heard)
    assert (after.seq, len(after)) == (400, 301)
    heard_since = bench.alarm_states()
    assert [*heard_before, *heard_since].count(("disk", "unacknowledged")) == 1, "and nobody twice"
    whole = RigMonitor(MODEL).update(wave_of(701))
    assert whole is not None
    assert same(concatenate([before, after]), whole.estimates), "it knows what went before"


def wave_of(count: int) -> SampleBlock:
    return concatenate([wave(seq, 1, 7, 0) for seq in range(count)])


def test_lost_samples_are_an_alarm(bench: Bench) -> None:
    for seq in (0, 1, 2, 10):
        bench.send(wave(seq, 1, 7, 0))
    bench.turn_until(10)
    bench.turn()
    assert ("loss", "unacknowledged") in bench.alarm_states()


def test_samples_without_a_channel_are_reported_as_unsuitable(bench: Bench) -> None:
    whole = wave(0, 4, 7, 0)
    part = SampleBlock("rig", 7, 0, whole.device_us, whole.t_ns, whole.channels[:2])
    bench.send(part)

    def told() -> bool:
        bench.turn()
        said = [h for h in bench.heard[HEALTH].drain() if isinstance(h, Health)]
        return any(h.state == "unsuitable" and "acceleration" in h.text for h in said)

    assert wait_until(told, PATIENCE)


def test_health_counts_samples_losses_and_latency(bench: Bench) -> None:
    now = time.time_ns()
    found: list[Health] = []

    def told() -> bool:
        bench.send(wave(len(found), 1, 7, now))
        bench.turn()
        found.extend(h for h in bench.heard[HEALTH].drain() if h.counters["samples"] > 0)
        return bool(found)

    assert wait_until(told, PATIENCE)
    assert found[0].source == "monitor"
    assert {"lost_samples", "queue_length", "latency_ms", "latency_p99_ms"} <= set(
        found[0].counters
    )


def test_without_a_monitor_the_list_reports_it() -> None:
    with pytest.raises(BusError, match="no monitor of rig bench answers"):
        ask_alarm_list(MemoryNetwork().bus("bench", "asker"))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name = "acceleration"', 'name = "accel"', "found acceleration, expected channels of"),
        ("[rig]", "[rig]\nsample_rate = 512.0", "found 256 Hz, expected 512 Hz"),
    ],
)
def test_a_model_of_another_rig_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    path = TestRig(tmp_path, monitor_section(tmp_path)).path
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ConfigError, match=told):
        suitable_model(load_rig(path), path)


def seen(
    t_s: float, monotonic_s: float, silent: float = 0.0, trouble: str = "", flowed: bool = False
) -> Seen:
    return Seen(
        int(t_s * 1e9), int(monotonic_s * 1e9), silent, trouble, flowed, False, "rig", (7, 9)
    )


def holding(watch: LinkWatch, at: Seen) -> set[str]:
    return {name for name, _, holds in watch.reports(at) if holds}


def test_each_alarm_of_the_link_holds_as_long_as_its_reason() -> None:
    watch = LinkWatch(stale_after=0.1)
    assert holding(watch, seen(0, 0)) == set()
    assert holding(watch, seen(1, 1, silent=0.2)) == {"stale"}
    assert holding(watch, seen(1, 1, silent=0.2, trouble="cable")) == {"stale", "link"}
    assert holding(watch, seen(1, 1, trouble="not opened yet")) == set()
    assert holding(watch, seen(1, 1, trouble="cable", flowed=True)) == {"link"}
    watch.lost(3, int(2e9))
    assert holding(watch, seen(2.5, 2.5)) == {"loss"}
    assert holding(watch, seen(4, 4)) == set()


def test_a_reason_counts_once_it_has_lasted_and_attempts_that_fail_in_turn_do_not() -> None:
    watch = LinkWatch(0.1)
    reasons = [("", 0.0), ("no answer", 1.0), ("closed", 2.0), ("no answer", 3.0)]
    assert not any(watch.lasting_reason(seen(t, t, trouble=why)) for why, t in reasons)
    assert watch.lasting_reason(seen(4.9, 4.9, trouble="no answer")) == ""
    assert watch.lasting_reason(seen(5.1, 5.1, trouble="no answer")) == "no answer"
    assert watch.lasting_reason(seen(5.2, 5.2, trouble="another device")) == ""
    assert watch.lasting_reason(seen(7.3, 7.3, trouble="another device")) == "another device"


def test_reasons_that_take_turns_are_told_once_a_minute_at_most() -> None:
    watch = LinkWatch(0.1)
    turns = [("no answer", "closed")[t // 5 % 2] for t in range(300)]
    told = [watch.lasting_reason(seen(t, t, trouble=why)) for t, why in enumerate(turns)]
    assert [why for why in told if why] == ["no answer", "closed"]
    watch.lasting_reason(seen(301, 301))
    again = [watch.lasting_reason(seen(t, t, trouble="closed")) for t in (302, 303, 304)]
    assert again == ["", "", "closed"]


def test_a_clock_that_was_set_is_noticed_and_one_that_runs_is_not() -> None:
    watch = LinkWatch(0.1)
    assert [watch.clock_step(seen(t, t)) for t in (0, 1, 2)] == [0, 0, 0]
    assert watch.clock_step(seen(3 - 30, 3)) == pytest.approx(-30e9)
    assert watch.clock_step(seen(4 - 30, 4)) == 0


def test_certificates_that_end_are_an_alarm_until_they_are_issued_anew(tmp_path: Path) -> None:
    watch, today = KeyWatch(str(tmp_path)), datetime(2026, 3, 1, tzinfo=UTC).timestamp()

    def told(minutes: float, **ends: str) -> list[tuple[str, bool]]:
        issued = tuple(Issued(name, name, 1, date) for name, date in ends.items())
        (tmp_path / REGISTER).write_bytes(msgspec.json.encode(Register("bench", issued)))
        found = watch.reports(seen(today, 60.0 * minutes))
        return [(at.text, holds) for _, at, holds in found]

    assert told(0, daq="2026-04-01", router="2028-01-01") == [("", False)]
    assert told(1, daq="2026-03-31", router="2026-02-01") == [
        ("router 2026-02-01, daq 2026-03-31", True)
    ]
    assert told(1.5) == [("router 2026-02-01, daq 2026-03-31", True)], "not read again yet"
    assert told(2, daq="2028-03-01", router="2028-03-01") == [("", False)]


def test_the_recorders_troubles_are_alarms_and_clear(bench: Bench) -> None:
    names = ("disk", "disk_almost_full", "recording_stopped")
    recorder = bench.network.bus("bench", "recorder")

    def told(state: str, free: float, trouble: float) -> set[tuple[str, str]]:
        counters = {"disk_trouble": trouble, "free_share": free}
        recorder.publish(HEALTH, Health("recorder", 1, state, "", counters))
        bench.turn()
        return {(name, state) for name, state in bench.alarm_states() if name in names}

    raised, cleared = "unacknowledged", "cleared_unacknowledged"
    assert told("recording", 0.4, 0.0) == set()
    assert told("recording", 0.09, 1.0) == {("disk", raised)}
    assert told("recording", 0.019, 1.0) == {("disk_almost_full", raised)}
    assert told("not recording", 0.0, 1.0) == {("recording_stopped", raised)}
    assert told("recording", 0.4, 0.0) == {(name, cleared) for name in names}


@pytest.mark.parametrize(
    ("alarm", "state", "counters"),
    [
        ("line_noise", "garbage", {}),
        ("duplicate_source", "two devices", {}),
        ("slow_device", "slow", {}),
        ("clock_drift", "running", {"drift_ppm": -600.0}),
        ("clock_wrong", "running", {"drift_ppm": 6000.0}),
        ("clock_drift", "running", {"drift_ppm": 800.0, "certain_drift_ppm": 600.0}),
    ],
)
def test_what_daq_says_of_its_device_is_an_alarm_and_clears(
    bench: Bench, alarm: str, state: str, counters: dict[str, float]
) -> None:
    told = []
    for at, figures in ((state, counters), ("running", {"drift_ppm": 20.0})):
        bench.daq.publish(HEALTH, Health("daq/rig", 1, at, "", figures))
        bench.turn()
        told += [change for change in bench.alarm_states() if change[0] == alarm]
    assert told == [(alarm, "unacknowledged"), (alarm, "cleared_unacknowledged")]


def test_a_drift_that_is_not_certain_is_no_alarm(bench: Bench) -> None:
    figures = {"drift_ppm": 6000.0, "certain_drift_ppm": 100.0}
    bench.daq.publish(HEALTH, Health("daq/rig", 1, "running", "", figures))
    bench.turn()
    assert not {name for name, _ in bench.alarm_states()} & {"clock_drift", "clock_wrong"}


def test_what_another_process_says_of_daq_and_recorder_changes_no_alarm(bench: Bench) -> None:
    recorder, dashboard = (bench.network.bus("bench", name) for name in ("recorder", "dashboard"))
    recorder.publish(HEALTH, Health("recorder", 1, "not recording", "", {}))
    bench.turn()
    assert ("recording_stopped", "unacknowledged") in bench.alarm_states()
    for source, state, figures in (
        ("recorder", "stopped", {}),
        ("recorder", "recording", {}),
        ("daq/rig", "running", {"drift_ppm": 9e3}),
        ("daq/rig", "garbage", {}),
    ):
        dashboard.publish(HEALTH, Health(source, 1, state, "", figures))
        bench.turn()
    assert bench.alarm_states() == []
    assert len(bench.got(HEALTH)) >= 5, "who displays them gets them all"


def test_samples_without_estimates_are_an_alarm(bench: Bench) -> None:
    whole = wave(0, 600, 7, 0)
    channels = whole.channels[:2]
    bench.send(SampleBlock("rig", 7, 0, whole.device_us, whole.t_ns, channels))
    bench.turn_until(599)
    bench.turn()
    assert ("estimates_missing", "unacknowledged") in bench.alarm_states()


def test_the_return_of_a_router_is_reported_to_those_who_only_listen(bench: Bench) -> None:
    bench.network.up = False
    bench.turn()
    bench.network.up = True
    bench.turn()
    assert "ROUTER BACK" in [event.code for event in bench.heard[EVENTS].drain()]


def test_a_recorder_that_dies_is_an_alarm_and_one_that_is_stopped_is_none(bench: Bench) -> None:
    def stopped() -> list[str]:
        bench.turn()
        return [state for name, state in bench.alarm_states() if name == "recording_stopped"]

    recorder = bench.network.bus("bench", "recorder")
    recorder.publish(HEALTH, Health("recorder", 1, "recording", "", {}))
    assert stopped() == []
    recorder.close()
    assert stopped() == []
    recorder = bench.network.bus("bench", "recorder")
    assert stopped() == [], "its link was only made again"
    recorder.close()
    assert wait_until(lambda: stopped() == ["unacknowledged"], PATIENCE)
    recorder = bench.network.bus("bench", "recorder")
    recorder.publish(HEALTH, Health("recorder", 1, "recording", "", {}))
    assert stopped() == ["cleared_unacknowledged"]
    recorder.publish(HEALTH, Health("recorder", 1, "stopped", "", {}))
    recorder.close()
    assert stopped() == []
