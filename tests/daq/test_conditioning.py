"""Calibration and quality flags: what each means, and that blocks may be cut anywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.adapter import RawBlock, picked
from daq.conditioning import Conditioner
from rigwatch.wire.device.calibration import Calibration
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.messages.message_types import SampleBlock
from rigwatch.wire.rig_config import ChannelSection


def channel(name: str, **keys: float) -> ChannelSection:
    return ChannelSection(name=name, unit="V", gain=0.5, offset=1.0, **keys)  # type: ignore[arg-type]


def raw_of(codes: object, boot: int = 1) -> RawBlock:
    table = np.asarray(codes)
    seq = np.arange(len(table))
    return RawBlock(boot, seq, seq * 3906, table, np.zeros(len(table), np.int64))


def judged(codes: object, *channels: ChannelSection) -> SampleBlock:
    raw = raw_of(codes)
    return Conditioner(channels).condition(raw, raw.device_us * 1000)


def flags(block: SampleBlock, name: str, flag: int) -> list[int]:
    return np.flatnonzero(block.channel(name).quality & flag).tolist()


def test_codes_become_si_and_back() -> None:
    calibration = Calibration.of([channel("a"), channel("b")])
    values = calibration.values([[0, 2], [4, -6]])
    np.testing.assert_array_equal(values, [[1.0, 2.0], [3.0, -2.0]])
    np.testing.assert_array_equal(calibration.codes(values), [[0, 2], [4, -6]])


def test_rails_count_from_the_third_sample() -> None:
    block = judged([[0], [32767], [32767], [32767], [32767], [0], [-32768]], channel("a"))
    assert flags(block, "a", quality.SATURATED) == [3, 4]


def test_a_value_outside_the_range_counts_at_once() -> None:
    block = judged([[0], [30], [-30]], channel("a", low=-10.0, high=10.0))
    assert flags(block, "a", quality.SATURATED) == [1, 2]


def stuck(*codes: np.ndarray, after: int = 20) -> list[list[int]]:
    """Samples at which each channel counts as stuck."""
    names = "abcdef"[: len(codes)]
    block = judged(np.stack(codes, axis=1), *(channel(name, stuck_after=after) for name in names))
    return [flags(block, name, quality.STUCK) for name in names]


def test_a_dead_sensor_is_stuck_only_while_the_others_move() -> None:
    dies, moving = np.arange(120) % 3, np.arange(120) % 2 * 1000
    dies[60:] = 7
    assert stuck(dies, moving, -moving) == [list(range(79, 120)), [], []]
    assert stuck(dies, moving, np.full(120, 7))[0] == []


def test_a_sensor_that_is_dead_from_the_start_is_stuck_after_three_times_as_long() -> None:
    still, moving = np.full(120, 7), np.arange(120) % 2 * 1000
    assert stuck(still, moving) == [list(range(59, 120)), []]


def test_a_sensor_that_dies_again_and_again_is_stuck_each_time() -> None:
    dies, moving = np.arange(400) % 3, np.arange(400) % 2 * 1000
    for first in range(60, 400, 100):
        dies[first : first + 40] = 7
    wanted = [at for first in range(60, 400, 100) for at in range(first + 19, first + 40)]
    assert stuck(dies, moving)[0] == wanted


@pytest.mark.parametrize("half_period", [25, 50])
@pytest.mark.parametrize(("missed", "rest"), [(0, 0), (18, 0), (0, 400)])
def test_a_set_value_that_is_held_is_not_stuck(half_period: int, missed: int, rest: int) -> None:
    """A square wave without noise: from an edge, from within a half period, and after rest."""
    square = np.where(np.arange(missed, 1000) // half_period % 2, 6000, -6000)
    moving = np.arange(1000 - missed) % 2 * 1000
    noise = np.arange(rest) % 2
    assert stuck(np.append(np.zeros(rest), square), np.append(noise, moving)) == [[], []]


def test_a_single_channel_is_never_stuck() -> None:
    codes = np.arange(120) % 3
    codes[60:] = 7
    assert stuck(codes) == [[]]


def test_zero_switches_stuck_off() -> None:
    codes = np.stack([np.full(60, 7), np.arange(60) % 2 * 1000], axis=1)
    block = judged(codes, channel("a", stuck_after=0), channel("b"))
    assert not flags(block, "a", quality.STUCK)


def test_non_finite_is_held_and_flagged() -> None:
    block = judged([[np.nan], [4.0], [np.inf], [6.0]], channel("a"))
    assert flags(block, "a", quality.NON_FINITE) == [0, 2]
    np.testing.assert_array_equal(block.channel("a").values, [0.0, 3.0, 3.0, 4.0])


def test_a_spike_is_flagged_and_a_step_soon_believed() -> None:
    spike = judged([[0], [0], [100], [0]], channel("a", spike_above=10.0))
    assert flags(spike, "a", quality.SPIKE) == [2]
    step = judged([[0], *[[100]] * 8], channel("a", spike_above=10.0))
    assert flags(step, "a", quality.SPIKE) == [1, 2, 3, 4]


def test_a_new_boot_forgets_what_was_before() -> None:
    conditioner = Conditioner([channel("a")])
    first, second = raw_of([[32767]] * 2, boot=1), raw_of([[32767]] * 2, boot=2)
    for raw in (first, second):
        assert not conditioner.condition(raw, raw.device_us).channel("a").quality.any()


def test_recorded_values_keep_their_quality() -> None:
    raw = RawBlock(
        1,
        np.arange(3),
        np.arange(3),
        np.array([[1.5], [np.nan], [2.5]]),
        np.zeros(3, np.int64),
        calibrated=True,
        quality=np.array([[quality.SPIKE], [0], [0]], np.uint8),
    )
    column = Conditioner([channel("a")]).condition(raw, raw.device_us).channel("a")
    np.testing.assert_array_equal(column.values, [1.5, 1.5, 2.5])
    np.testing.assert_array_equal(column.quality, [quality.SPIKE, quality.NON_FINITE, 0])


CODES = st.sampled_from([0.0, 1.0, 500.0, -500.0, 32767.0, -32768.0, np.nan])


@pytest.mark.filterwarnings("error")
@given(st.lists(st.tuples(CODES, CODES, CODES), min_size=1, max_size=60), st.data())
def test_how_blocks_are_cut_changes_nothing(
    rows: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    keys = {"stuck_after": 5, "spike_above": 300.0, "low": -1e4, "high": 1.6e4}
    channels = [channel(name, **keys) for name in "abc"]
    raw = raw_of(rows)
    whole = Conditioner(channels).condition(raw, raw.device_us)
    cuts = data.draw(st.lists(st.integers(0, len(rows)), max_size=6).map(sorted))
    conditioner, parts = Conditioner(channels), []
    for start, stop in zip([0, *cuts], [*cuts, len(rows)], strict=True):
        if stop > start:
            part = picked(raw, slice(start, stop))
            parts.append(conditioner.condition(part, part.device_us))
    for index, name in enumerate("abc"):
        values = np.concatenate([part.channels[index].values for part in parts])
        judged_flags = np.concatenate([part.channels[index].quality for part in parts])
        np.testing.assert_array_equal(values, whole.channel(name).values)
        np.testing.assert_array_equal(judged_flags, whole.channel(name).quality)
        assert np.isfinite(values).all()
