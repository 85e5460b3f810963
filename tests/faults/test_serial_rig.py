"""Faults of a serial device and its sensors, on one running rig: daq and monitor as processes."""

import contextlib
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from rigwatch.wire.bus import ask_alarm_list
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import SAMPLES, Alarm
from rigwatch.wire.messages import quality_flags as quality
from tests.bus.rig import rigwatch
from tests.faults.field import (
    AMPLITUDE,
    PERIOD_NS,
    RATE,
    Field,
    SerialDevice,
    least_of,
    serial_field,
)
from tests.waiting import eventually, wait_until

pytestmark = [pytest.mark.xdist_group("faults-serial"), pytest.mark.long]
POSITION, ACCELERATION = 1, 2


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Field, SerialDevice]]:
    keys = {"position": "spike_above = 0.004"}
    silence = "[daq]\nstale_after = 0.09\n"
    with serial_field(tmp_path_factory.mktemp("serial"), keys=keys, extra=silence) as made:
        yield made


@pytest.fixture
def rig(field: tuple[Field, SerialDevice]) -> Field:
    return field[0]


@pytest.fixture
def device(field: tuple[Field, SerialDevice]) -> SerialDevice:
    return field[1]


def counted(rig: Field, name: str) -> float:
    """A counter of daq, from a health message that is sent after now."""
    return rig.health_after("daq", time.time_ns()).counters.get(name, 0.0)


def lost(rig: Field, since: int) -> list[tuple[int, int]]:
    """First and last of the gaps that daq has reported after the first `since`."""
    return [(g.first, g.last) for g in rig.gaps[since:] if g.reporter == "daq/rig"]


def estimated(rig: Field, boot: int, first: int, last: int, column: str = "") -> np.ndarray:
    """Numbers of the samples with estimates, or a column of them, once all have come."""
    rig.judged(boot, last)
    near = [
        b for b in rig.estimates() if b.boot == boot and b.seq <= last and b.seq + len(b) > first
    ]
    if not near:
        return np.zeros(0)
    seqs = np.concatenate([np.arange(b.seq, b.seq + len(b)) for b in near])
    values = np.concatenate([b.column(column).values for b in near]) if column else seqs
    return values[(seqs >= first) & (seqs <= last)]


def test_05_frames_with_wrong_checksums(rig: Field, device: SerialDevice) -> None:
    before, since = counted(rig, "crc_errors"), len(rig.gaps)
    device.faults.start("flip", 5)
    gap = rig.gap(since)
    alarm = rig.raised("gap", after_seq=gap.first)
    assert 5 <= gap.last - gap.first + 1 <= 6
    assert alarm.seq == gap.last + 1, "told with the next good frame"
    assert counted(rig, "crc_errors") > before


# Before the tests that lose more: from the fifth gap in a minute on, all are one alarm.
def test_35_a_gap_in_the_samples(rig: Field, device: SerialDevice) -> None:
    rig.cleared("gap")
    rig.calm(device.device, "gap")
    ready(rig, device)
    boot, since = device.device.boot, len(rig.gaps)
    device.faults.start("lose", 2)
    short = rig.gap(since)
    assert short.last - short.first == 1
    armed = estimated(rig, boot, short.last + 1, short.last + 32, "armed")
    assert armed.all(), "predicted through"
    assert rig.raised("gap", after_seq=short.first).seq == short.last + 1
    residual = estimated(rig, boot, short.last + 1, short.last + 32, "residual")
    before = estimated(rig, boot, short.first - 64, short.first - 1, "residual")
    assert np.abs(residual).max() < 4.0 * np.abs(before).max(), "no filter has started anew"
    rig.cleared("gap")
    for samples in (3, 60):
        ready(rig, device)
        since = len(rig.gaps)
        device.faults.start("lose", samples)
        long = rig.gap(since)
        assert long.last - long.first + 1 == samples
        alarm = rig.raised("gap", after_seq=long.first)
        assert alarm.seq == long.last + 1
        assert not estimated(rig, boot, long.first, long.last).size, "nothing is made up"
        for column in ("armed", "observable"):
            anew = estimated(rig, boot, long.last + 1, long.last + 7, column)
            assert not anew.any(), "filters and window start anew"
        assert not estimated(rig, boot, long.last + 1, long.last + 32, "armed").any()
        for name in ("theta1", "theta2", "residual"):
            assert np.isfinite(estimated(rig, boot, long.last + 1, long.last + 64, name)).all()
        rig.cleared("gap")


@pytest.mark.parametrize("kind", ["drop", "insert"])
def test_06_dropped_and_inserted_bytes(rig: Field, device: SerialDevice, kind: str) -> None:
    boot, since, first = device.device.boot, len(rig.gaps), device.device.next_seq
    device.faults.start(kind, 1)
    rig.judged(boot, first + 64)
    eventually(lambda: len(lost(rig, since)) > 0 or kind == "insert", "the gap")
    told = [n for a, b in lost(rig, since) for n in range(a, b + 1)]
    assert len(told) <= 2
    came = estimated(rig, boot, first, first + 64).tolist()
    assert sorted([*came, *told]) == list(range(first, first + 65)), "all but the gap"


def test_07_frames_that_come_twice(rig: Field, device: SerialDevice) -> None:
    before, first, boot = counted(rig, "duplicates"), device.device.next_seq, device.device.boot
    device.faults.start("duplicate", 5)
    assert counted(rig, "duplicates") == before + 5
    numbers = estimated(rig, boot, first, first + 64)
    assert numbers.tolist() == list(range(first, first + 65))


def test_08_a_device_that_starts_anew_and_a_counter_that_wraps(
    rig: Field, device: SerialDevice
) -> None:
    was, since, top = device.device.boot, len(rig.gaps), 2**32
    device.source.inject(lambda codes: device.device.restart(first_seq=top - 64), 1).sent()
    event = rig.event("boot_changed", device.line.plugged_ns)
    boot = device.device.boot
    assert f"boot {boot:08x} follows {was:08x}" in event.text
    gap = rig.gap(since)
    assert (gap.boot, gap.last) == (was, gap.first - 1), "of unknown length"
    numbers = estimated(rig, boot, top - 64, top + 64)
    assert numbers.tolist() == list(range(numbers[0], top + 65))
    assert numbers[0] <= top - 62
    assert len(lost(rig, since)) == 1
    (first,) = [b for b in rig.estimates() if b.boot == boot][:1]
    assert abs(event.t_ns - int(first.t_ns[0])) <= PERIOD_NS * len(first), "with the same frame"


def test_10_a_clock_that_jumps(rig: Field, device: SerialDevice) -> None:
    ready(rig, device)
    boot, before = device.device.boot, time.time_ns() - 10**9
    jump = device.source.inject(lambda codes: device.device.jump_clock(0.5), 1).sent()
    event = rig.event("clock_jump", before)
    assert "jumped by +0.5" in event.text
    rig.judged(boot, jump + 64)
    blocks = [b for b in rig.estimates() if b.boot == boot]
    t_ns = {b.seq + i: int(t) for b in blocks for i, t in enumerate(b.t_ns)}
    assert abs(event.t_ns - t_ns[jump]) <= 3 * PERIOD_NS, "within the frame"
    steps = np.diff([t_ns[seq] for seq in range(jump - 32, jump + 64)])
    assert steps.min() > 0
    assert steps.max() < 0.25e9, "the stamps follow the host's clock"
    armed = estimated(rig, boot, jump - 1, jump, "armed")
    assert armed.tolist() == [1.0, 0.0], "the filters start anew"


def test_10_a_device_that_pauses_without_counting(rig: Field, device: SerialDevice) -> None:
    ready(rig, device)
    boot, since, began = device.device.boot, len(rig.gaps), time.time_ns()
    first = device.device.next_seq
    device.pause_s = 0.3
    eventually(lambda: device.pause_s == 0.0, "the device pauses")
    last = device.device.next_seq
    rig.judged(boot, last + 64)
    stamps = {
        b.seq + i: int(t) for b in rig.estimates() if b.boot == boot for i, t in enumerate(b.t_ns)
    }
    longest = max(range(first, last + 64), key=lambda n: stamps[n] - stamps[n - 1])
    assert stamps[longest] - stamps[longest - 1] >= 0.3e9, "the stamps show it"
    assert estimated(rig, boot, longest - 1, longest, "armed").tolist() == [1.0, 0.0]
    assert lost(rig, since) == [], "no number is missing"
    assert not [e for e in rig.events if e.code == "clock_jump" and e.t_ns >= began]


def ready(rig: Field, device: SerialDevice) -> None:
    """The monitor has its reference again."""
    boot = device.device.boot

    def armed() -> bool:
        last = rig.estimates()[-1]
        return last.boot == boot and last.column("armed").values[-1] == 1.0

    eventually(armed, "armed")


def test_13_a_signal_at_its_rail(rig: Field, device: SerialDevice) -> None:
    ready(rig, device)

    def rail(codes: np.ndarray) -> None:
        codes[:, ACCELERATION] = 32767

    first = device.source.inject(rail, 8).sent()
    boot = device.device.boot
    alarm = rig.raised("sensor_saturated.acceleration", after_seq=first)
    assert alarm.seq - first < 0.012 * RATE
    flags = rig.read("acceleration", boot, first, first + 8)[1] & quality.SATURATED
    assert np.flatnonzero(flags).tolist() == list(range(2, 8)), "from the third sample on"
    for name in ("theta1", "theta2"):
        theta = estimated(rig, boot, first, first + 64, name)
        assert np.isfinite(theta).all()
        assert (theta[2:8] == theta[1]).all(), "kept out of the estimates"


def test_17_spikes(rig: Field, device: SerialDevice) -> None:
    before = counted(rig, "flagged_spike")

    def spike(codes: np.ndarray) -> None:
        codes[:, POSITION] += 9000

    def quiet(codes: np.ndarray) -> None:
        """Nothing."""

    ready(rig, device)
    # Estimates are zero before a rig is armed.
    device.source.inject(quiet, 64).sent()
    boot, single = device.device.boot, device.source.inject(spike, 1).sent()
    assert counted(rig, "flagged_spike") == before + 1
    flags = rig.read("position", boot, single - 1, single + 1)[1] & quality.SPIKE
    assert flags.tolist() == [0, quality.SPIKE, 0], "that sample"
    for name in ("theta1", "theta2"):
        theta = estimated(rig, boot, single - 64, single + 256, name)
        assert np.abs(theta[64:]).max() < 3.0 * np.abs(theta[:64]).max() + 0.01, "kept out"
    assert rig.journalled("sensor_spike.position") == []
    for _ in range(3):
        last = device.source.inject(spike, 1).sent()
        device.source.inject(quiet, 40).sent()
        time.sleep(0.15)
    assert rig.raised("sensor_spike.position").seq == last, "with the third within a second"
    assert counted(rig, "flagged_spike") == before + 4


def test_11_a_stuck_sensor(rig: Field, device: SerialDevice) -> None:
    def stuck(codes: np.ndarray) -> None:
        codes[:, ACCELERATION] = 1234

    first = device.source.inject(stuck, 140).sent()
    alarm = rig.raised("sensor_stuck.acceleration", after_seq=first)
    assert alarm.seq - first < 0.4 * RATE


@pytest.mark.nightly
def test_15_a_gain_that_changes(rig: Field, device: SerialDevice) -> None:
    rig.calm(device.device, "departure")
    ready(rig, device)

    def gain(codes: np.ndarray) -> None:
        codes[:, ACCELERATION] *= 1.5

    def raised(first: int) -> bool:
        return any(one.active and one.alarm.seq >= first for one in rig.journalled("departure"))

    # The fault of the test before may still stand, or disarm the monitor at this very moment.
    for _ in range(5):
        ready(rig, device)
        first = device.source.inject(gain, 256).sent()
        if wait_until(partial(raised, first), 10.0):
            break
    alarm = rig.raised("departure", after_seq=first)
    assert alarm.seq - first <= RATE


class Standstill:
    """From a turning point on, where the velocity is zero, some channels show only noise."""

    def __init__(self, channels: slice) -> None:
        self._channels, self._chance = channels, np.random.default_rng(3)
        self.moved, self.stands = 0, False

    def __call__(self, codes: np.ndarray) -> None:
        self.stands = self.stands or abs(codes[0, POSITION]) >= AMPLITUDE - 1
        if self.stands:
            shape = codes[:, self._channels].shape
            codes[:, self._channels] = self._chance.integers(-2, 3, shape)
        else:
            self.moved += 1


def test_36_a_rig_that_stands_still(rig: Field, device: SerialDevice) -> None:
    ready(rig, device)
    still = Standstill(slice(None))
    first, boot = device.source.inject(still, 640).sent(), device.device.boot
    frozen(rig, boot, first + still.moved + round(RATE), first + 600)
    rig.judged(boot, first + 700)


def frozen(rig: Field, boot: int, first: int, last: int) -> None:
    """The estimates are marked as not observable, and neither they nor their bounds change."""
    assert not estimated(rig, boot, first, last, "observable").any()
    for name in ("theta1", "theta2", "theta1_high", "theta2_high"):
        values = estimated(rig, boot, first, last, name)
        assert np.isfinite(values).all()
        assert (values == values[0]).all(), "frozen and bounded"


@pytest.mark.nightly  # half a minute of a rig; one that stands still is tried by day
def test_36_a_rig_that_is_driven_and_stands_still(rig: Field, device: SerialDevice) -> None:
    ready(rig, device)
    held = Standstill(slice(POSITION, None))
    first, boot = device.source.inject(held, 1280).sent(), device.device.boot
    remark = rig.raised("not_observable", after_seq=first)
    # The window, and the decay of the velocity's filter to the least velocity.
    assert 0 <= remark.seq - (first + held.moved) <= 3 * RATE
    assert estimated(rig, boot, remark.seq, remark.seq, "armed").tolist() == [1.0]
    frozen(rig, boot, first + held.moved + round(RATE), first + 1270)
    rig.cleared("not_observable")


def test_42_a_slow_reader(rig: Field, device: SerialDevice) -> None:
    slow = rig.bus.subscribe_lossy(SAMPLES, capacity=16)
    since, first, boot = len(rig.gaps), device.device.next_seq, device.device.boot
    rig.judged(boot, first + 256)
    slow.close()
    dropped, kept = slow.dropped, slow.drain()
    assert dropped > 0
    assert len(kept) == 16, "the oldest go, the newest stay"
    assert all(b.seq == a.seq + len(a) for a, b in pairwise(kept))
    assert lost(rig, since) == []


def noticed_within(
    seconds: float, rig: Field, device: SerialDevice, name: str, faulty: Callable[[bool], None]
) -> None:
    """The alarm comes in time after `faulty(True)`.

    It is not waited for to clear: on a machine that makes samples late again and again it
    chatters, and stays for as long as that goes on. Each attempt has a monitor without a past.
    """
    rig.calm(device.device, name)

    def attempt() -> float:
        began = time.time_ns()
        faulty(True)
        took = rig.noticed(name, began)
        faulty(False)
        return took

    least_of(attempt, seconds, lambda: rig.renew_monitor(device.device), tries=5)


def test_03_a_silent_device(rig: Field, device: SerialDevice) -> None:
    def silent(now: bool) -> None:
        device.silent = now

    noticed_within(0.1, rig, device, "stale", silent)


def test_16_a_slow_device(rig: Field, device: SerialDevice) -> None:
    def slow(now: bool) -> None:
        device.slow_down(2.0 if now else 1.0)

    noticed_within(0.5, rig, device, "slow_device", slow)


def test_04_garbage_on_the_line(rig: Field, device: SerialDevice) -> None:
    before = counted(rig, "skipped_bytes")
    rig.calm(device.device, "line_noise")

    def garbage() -> float:
        began, first = time.time_ns(), device.device.next_seq
        device.faults.start("garbage")
        took = rig.noticed("line_noise", began)
        newest = rig.estimates()[-1]
        assert newest.seq + len(newest) <= first + 4, "no sample of garbage is accepted"
        device.faults.stop("garbage")
        rig.cleared("line_noise")
        return took

    least_of(garbage, 1.0, lambda: rig.renew_monitor(device.device))
    assert counted(rig, "skipped_bytes") > before


def test_01_an_unplugged_device(rig: Field, device: SerialDevice) -> None:
    rig.calm(device.device, "link")

    def unplug() -> float:
        """The longer of the times to the alarm and to the return, as a share of its bound."""
        rig.cleared("link")
        boot, since, began = device.device.boot, len(rig.gaps), time.time_ns()
        first = device.device.next_seq
        device.faults.start("unplug", 400)
        alarm = rig.raised("link", after_ns=began)
        assert "the line was closed" in alarm.cause
        rig.cleared("link")
        gap = rig.gap(since)
        assert gap.last - gap.first + 1 >= 380
        came = estimated(rig, boot, min(first, gap.first) - 64, gap.last + 64).tolist()
        whole = set(range(min(first, gap.first) - 64, gap.last + 65))
        assert whole - set(came) == set(range(gap.first, gap.last + 1)), "the exact numbers"
        (back,) = (int(b.t_ns[gap.last + 1 - b.seq]) for b in rig.estimates()
                   if b.boot == boot and b.seq <= gap.last + 1 < b.seq + len(b))  # fmt: skip
        told_s = (alarm.t_ns - device.line.unplugged_ns) * 1e-9
        return max(told_s / 0.1, (back - device.line.plugged_ns) * 1e-9 / 1.0)

    least_of(unplug, 1.0, lambda: rig.renew_monitor(device.device))


def test_02_a_device_plugged_in_under_another_name(rig: Field, device: SerialDevice) -> None:
    began = time.time_ns()
    device.faults.start("unplug", 200, device.line.link.with_name("line-b"))
    device.source.inject(lambda codes: None, 100).sent()
    device.device.restart()
    event = rig.event("boot_changed", began)
    assert f"boot {device.device.boot:08x}" in event.text
    assert event.t_ns - device.line.plugged_ns < 2e9
    rig.judged(device.device.boot, device.device.next_seq)
    first = next(b for b in rig.estimates() if b.boot == device.device.boot)
    assert first.t_ns[0] - device.line.plugged_ns < 2e9
    assert device.line.link.name == "line-b"


def test_18_a_second_daq_on_the_same_port(rig: Field, device: SerialDevice) -> None:
    second = rigwatch("daq", str(rig.rig.path))
    assert second.returncode == 2
    assert second.stderr.count("\n") == 1
    assert "in use by another process" in second.stderr
    rig.judged(device.device.boot, device.device.next_seq)


def constant(channel: int, code: int | None) -> Callable[[np.ndarray], None]:
    """One code in a channel; None leaves all as they are."""

    def edit(codes: np.ndarray) -> None:
        if code is not None:
            codes[:, channel] = code

    return edit


def standing(rig: Field) -> list[Alarm]:
    """The list of a monitor that may just be starting: the first answer counts."""
    found: list[list[Alarm]] = []

    def answered() -> bool:
        with contextlib.suppress(BusError):
            found.append(ask_alarm_list(rig.bus))
        return bool(found)

    eventually(answered, "the list of alarms")
    return found[0]


def test_48_a_flood_an_acknowledgement_and_a_restart(rig: Field, device: SerialDevice) -> None:
    rig.renew_monitor(device.device)
    began = time.time_ns()
    for channel in range(3):
        for edit, samples in ((constant(channel, 1234), 120), (constant(channel, 32767), 4)):
            device.source.inject(edit, samples).sent()
            device.source.inject(constant(channel, None), 8).sent()
            time.sleep(0.5)
    for _ in range(2):
        device.faults.start("lose", 40)
        device.faults.start("unplug", 64)
        time.sleep(1.5)
    flood = rig.raised("alarm_flood", after_ns=began)
    device.faults.start("unplug", 64)
    time.sleep(1.0)
    assert "first out was" in flood.cause
    assert [e for e in rig.events if e.code == "alarm_grouped"], "announced as events"
    shown = {alarm.name for alarm in rig.alarms if alarm.t_ns > flood.t_ns}
    assert "link" in shown, "a critical one is never grouped"
    done = rigwatch("ack", str(rig.rig.path), "link", "--user", "ann")
    assert done.returncode == 0, done.stderr
    record = rig.journalled("link")[-1].alarm
    assert (record.state, record.user) == ("acknowledged", "ann")
    assert abs(record.t_ns - time.time_ns()) < 60e9
    before = {alarm.name: alarm.state for alarm in ask_alarm_list(rig.bus)}
    rig.kill("monitor")
    rig.start("monitor")
    after = {alarm.name: alarm.state for alarm in standing(rig)}
    latched = {"link", "sensor_stuck.acceleration", "sensor_saturated.position"}
    assert latched <= before.keys()
    assert {name: after[name] for name in latched} == {name: before[name] for name in latched}
