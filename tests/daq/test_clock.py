"""Device time on host time: drift, jumps, late arrivals and the host's own clock."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.adapter import RawBlock
from daq.clock import SLOWER, DeviceClock
from rigwatch.wire.arrays import IntArray

PERIOD_NS = 1e9 / 256
UNIX_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


def run_of(count: int, first: int = 0, drift: float = 0.0, late_ns: object = 0) -> RawBlock:
    seq = np.arange(first, first + count)
    host = np.rint(seq * PERIOD_NS).astype(np.int64)
    us = np.rint(seq * PERIOD_NS * (1 + drift) / 1000).astype(np.int64)
    arrived = host + np.asarray(late_ns, np.int64)
    return RawBlock(1, seq, us, np.zeros((count, 1)), np.maximum.accumulate(arrived))


@pytest.mark.parametrize("drift", [-1e-3, 0.0, 4e-5, 1e-3])
def test_drift_is_found_and_followed(drift: float) -> None:
    late = np.random.default_rng(1).exponential(4e5, 256 * 60).astype(np.int64)
    late[5000:5100] += 80_000_000  # the host slept
    run = run_of(256 * 60, drift=drift, late_ns=late)
    clock = DeviceClock(256.0, unix_minus_monotonic_ns=UNIX_NS)
    stamps, jump = clock.stamp(run)
    assert jump == 0.0
    assert clock.drift_ppm == pytest.approx(1e6 * drift, abs=2.0)
    error = stamps - UNIX_NS - run.seq * PERIOD_NS
    assert np.abs(error[2560:]).max() < 200_000


@pytest.mark.parametrize("drift", [-1e-3, 7e-4])
def test_a_drift_is_certain_within_a_minute(drift: float) -> None:
    late = np.random.default_rng(1).exponential(3e6, 256 * 60).astype(np.int64)
    clock = DeviceClock(256.0)
    clock.stamp(run_of(256 * 60, drift=drift, late_ns=late))
    assert clock.certain_drift_ppm == pytest.approx(1e6 * drift, rel=0.1)


@pytest.mark.parametrize(("begin", "end"), [(11, 30), (11, 22), (0, 14)])
def test_a_host_that_becomes_busy_or_free_is_no_drift(begin: int, end: int) -> None:
    late = np.random.default_rng(1).exponential(1e6, 256 * 30)
    late[256 * begin : 256 * end] += 20e6
    clock, certain, seeming = DeviceClock(256.0), [], []
    for second in range(30):
        part = slice(256 * second, 256 * (second + 1))
        clock.stamp(run_of(256, first=256 * second, late_ns=late[part].astype(np.int64)))
        certain.append(abs(clock.certain_drift_ppm))
        seeming.append(abs(clock.drift_ppm))
    assert max(seeming) > 500.0
    assert max(certain) < 100.0


def test_what_waited_in_the_lines_buffer_at_the_start_does_not_stretch_time() -> None:
    waited = np.clip(700e6 - np.arange(2560) * PERIOD_NS, 0.0, None).astype(np.int64)
    late = waited + np.random.default_rng(2).exponential(1e6, 2560).astype(np.int64)
    stamps, _ = DeviceClock(256.0).stamp(run_of(2560, late_ns=late))
    after = np.diff(stamps[256:])[: 4 * 256]
    assert 256 * PERIOD_NS / np.convolve(after, np.ones(256), "valid").max() > 0.99
    assert after.max() < 2 * PERIOD_NS


@pytest.mark.parametrize("seconds", [0.05, 0.5, -0.5, 100.0])
def test_a_jump_is_seen_at_its_first_sample(seconds: float) -> None:
    clock = DeviceClock(256.0, unix_minus_monotonic_ns=UNIX_NS)
    before, _ = clock.stamp(run_of(500))
    after = run_of(500, first=500)
    jumped = RawBlock(
        1, after.seq, after.device_us + round(1e6 * seconds), after.codes, after.arrived_ns
    )
    stamps, jump = clock.stamp(jumped)
    assert jump == pytest.approx(seconds, abs=1e-4)
    assert clock.jumps == 1
    assert abs(stamps[0] - before[-1] - PERIOD_NS) < 100_000


def test_a_device_that_pauses_has_not_jumped() -> None:
    clock = DeviceClock(256.0)
    clock.stamp(run_of(500))
    later = run_of(100, first=500)
    paused = RawBlock(
        1, later.seq, later.device_us + 300_000, later.codes, later.arrived_ns + 300_000_000
    )
    assert clock.stamp(paused)[1] == 0.0


def test_a_late_block_has_not_jumped() -> None:
    clock = DeviceClock(256.0)
    clock.stamp(run_of(500))
    assert clock.stamp(run_of(100, first=500, late_ns=900_000_000))[1] == 0.0


@given(st.lists(st.integers(0, 50_000_000), min_size=10, max_size=10))
def test_time_only_goes_forward(late: list[int]) -> None:
    stamps, _ = DeviceClock(256.0).stamp(run_of(300, late_ns=np.repeat(late, 30)))
    assert (np.diff(stamps) > 0).all()


def test_a_replay_at_ten_times_the_speed_has_no_drift() -> None:
    clock = DeviceClock(256.0, clock_rate=10.0)
    run = run_of(256 * 40)
    fast = RawBlock(1, run.seq, run.device_us, run.codes, run.arrived_ns // 10)
    stamps, _ = clock.stamp(fast)
    assert abs(clock.drift_ppm) < 1.0
    assert stamps[-1] - stamps[0] == pytest.approx(4e9, rel=1e-2)


def test_a_step_of_the_wall_clock_is_followed_forward_at_once_and_back_slowly() -> None:
    clock = DeviceClock(256.0, unix_minus_monotonic_ns=UNIX_NS)
    assert clock.follow(UNIX_NS + 1000, 0) == 0.0
    assert clock.follow(UNIX_NS - 30 * SECOND, 1) == pytest.approx(-30.0)
    assert clock.unix_ns(5) == UNIX_NS + 5
    assert clock.ahead_s == pytest.approx(30.0)
    assert clock.follow(UNIX_NS - 30 * SECOND, SECOND // 50) == 0.0
    assert clock.unix_ns(5) == pytest.approx(UNIX_NS + 5 - SLOWER * SECOND / 50, abs=2)
    assert clock.follow(UNIX_NS + 10 * SECOND, SECOND // 20) == pytest.approx(40.0)
    assert clock.unix_ns(5) == UNIX_NS + 10 * SECOND + 5
    assert clock.ahead_s == 0.0


def stamps_while(clock: DeviceClock, offset: Callable[[float], int], seconds: int) -> IntArray:
    """Stamps of samples while the host's clocks differ by `offset` at a time [s]; looked at each
    sixteenth of a second.
    """
    found = []
    for k in range(16 * seconds):
        clock.follow(offset(k / 16), k * SECOND // 16)
        found.append(clock.stamp(run_of(16, first=16 * k))[0])
    return np.concatenate(found)


def test_after_a_step_back_stamps_run_slower_until_they_are_right() -> None:
    clock = DeviceClock(256.0, unix_minus_monotonic_ns=UNIX_NS)
    ahead, seconds = 0.6, 1400
    back = UNIX_NS - round(ahead * SECOND)
    stamps = stamps_while(clock, lambda at: UNIX_NS if at < 60 else back, seconds)
    steps = np.diff(stamps)
    assert steps.min() > 0.99 * PERIOD_NS
    assert steps.max() < 1.01 * PERIOD_NS
    late = stamps - UNIX_NS - np.arange(len(stamps)) * PERIOD_NS
    assert late[256 * 600] / SECOND == pytest.approx(-540 * SLOWER, abs=0.01)
    assert late[-1] / SECOND == pytest.approx(-ahead, abs=1e-3)
    assert clock.ahead_s == 0.0


def test_stamps_come_back_from_a_clock_that_was_far_ahead_for_a_while() -> None:
    clock = DeviceClock(256.0, unix_minus_monotonic_ns=UNIX_NS)
    wrong = UNIX_NS + 3600 * SECOND
    stamps = stamps_while(clock, lambda at: wrong if 20 <= at < 40 else UNIX_NS, 60)
    steps = np.diff(stamps)
    (back,) = np.flatnonzero(steps < 0)
    assert steps[back] == pytest.approx(-3600 * SECOND, abs=2 * PERIOD_NS)
    assert back == 40 * 256 - 1
    error = stamps - UNIX_NS - np.arange(len(stamps)) * PERIOD_NS
    assert np.abs(error[40 * 256 :]).max() < PERIOD_NS
    assert clock.ahead_s == 0.0


@pytest.mark.parametrize("clock_rate", [1.0, 10.0])
def test_samples_stamped_together_have_the_stamps_of_each_alone(clock_rate: float) -> None:
    random = np.random.default_rng(5)
    late = random.exponential(4e5, 256 * 40).astype(np.int64)
    run = run_of(256 * 40, drift=3e-4, late_ns=late)
    us = run.device_us.copy()
    us[256 * 30 + 7 :] += 70_000  # jumps in the middle of a block
    together = DeviceClock(256.0, clock_rate, unix_minus_monotonic_ns=UNIX_NS)
    alone = DeviceClock(256.0, clock_rate, unix_minus_monotonic_ns=UNIX_NS)
    ends = np.cumsum(random.integers(1, 14, len(us)))
    found, expected, jumps = [], [], []
    for part in np.split(np.arange(len(us)), ends[ends < len(us)]):
        block = RawBlock(1, run.seq[part], us[part], run.codes[part], run.arrived_ns[part])
        stamps, jump = together.stamp(block)
        found += stamps.tolist()
        jumps.append(jump)
        for row in zip(
            part.tolist(), us[part].tolist(), run.arrived_ns[part].tolist(), strict=True
        ):
            alone._stamp_one(*row)
            expected.append(alone._last_ns)
    assert found == expected
    assert together.jumps == alone.jumps >= 1
    assert any(jumps)
    assert (together.drift_ppm, together.certain_drift_ppm) == (
        alone.drift_ppm,
        alone.certain_drift_ppm,
    )
