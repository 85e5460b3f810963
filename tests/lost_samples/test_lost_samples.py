"""A serial line that loses single samples: a healthy rig raises nothing, and friction is named."""

from functools import cache

import numpy as np
import pytest

from monitor.pipeline.pipeline import PUBLISHED, Monitor, Result
from monitor.signals import conditions as kinds
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.messages.quality_flags import NON_FINITE
from sim_plant.excitation import Shape, Sine, Square, Triangle
from tests.monitor.monitor_rig import (
    OTHER_SINE,
    RATE,
    SINE,
    UNITS,
    active,
    block,
    friction,
    model,
    run,
)

SQUARE = Square(amplitude=1.0, frequency=8.0)
TRIANGLE = Triangle(amplitude=1.4, frequency=4.0)
DRIVES = {"known": SINE, "learnt": OTHER_SINE, "square": SQUARE, "triangle": TRIANGLE}
SLOW_SINE = Sine(amplitude=1.2, frequency=5.0)
PERIOD = 32
"""Samples of a period of the faster drives."""
Gaps = list[tuple[int, int]]


@cache
def learnt_sine() -> dict[str, np.ndarray]:
    """A healthy run with a drive that the model does not know."""
    return run(OTHER_SINE, 11.0, seed=35)


def parts(channels: dict[str, np.ndarray], gaps: Gaps) -> list[SampleBlock]:
    """The recording without the samples of the gaps, each a first sample and a length."""
    begins = [0, *(first + length for first, length in gaps)]
    ends = [*(first for first, _ in gaps), len(channels["voltage"])]
    return [block(channels, a, b) for a, b in zip(begins, ends, strict=True)]


def watched(blocks: list[SampleBlock]) -> list[Result]:
    monitor = Monitor(model())
    return [found for each in blocks if (found := monitor.update(each)) is not None]


def raised(results: list[Result], name: str) -> np.ndarray:
    return np.concatenate([active(result, name) for result in results])


def each(step: int, last: int, length: int = 1) -> Gaps:
    return [(first, length) for first in range(7, last - length, step)]


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("length", [1, 2])
def test_lost_samples_anywhere_in_the_period_raise_nothing(drive: Shape, length: int) -> None:
    channels = run(drive, 14.0, seed=31)
    gaps = [(1536 + (5 * PERIOD + 3) * k, length) for k in range(11)]
    results = watched(parts(channels, gaps))
    assert raised(results, kinds.NOT_OBSERVABLE)[-1] == 0
    assert results[-1].estimates.column("armed").values[-1] == 1.0
    for name in (kinds.DEPARTURE, kinds.OTHER_FAULT, kinds.DRY_FRICTION):
        assert not raised(results, name).any(), name


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("step", [64, 256])
def test_friction_is_named_on_a_line_that_loses_samples_all_the_time(
    drive: Shape, step: int
) -> None:
    last, onset = int(10.0 * RATE), int(7.0 * RATE)
    channels = run(drive, 10.0, friction(7.0), seed=32)
    results = watched(parts(channels, each(step, last)))
    seq = np.concatenate([one.estimates.seq + np.arange(len(one.estimates)) for one in results])
    armed = np.concatenate([one.estimates.column("armed").values for one in results])
    assert armed[seq == onset - 1] == 1.0
    departed = raised(results, kinds.DEPARTURE)
    assert not departed[seq < onset].any()
    assert departed[seq >= onset + 8].any()
    assert raised(results, kinds.DRY_FRICTION)[-1] == 1


def test_a_place_that_was_never_seen_is_learnt_when_the_line_is_mended() -> None:
    channels = run(OTHER_SINE, 12.0, seed=35)
    # The same places of every period.
    results = watched(parts(channels, [(first, 2) for first in range(15, 2000, PERIOD)]))
    assert results[-2].estimates.column("armed").values[-1] == 1.0
    assert not raised(results, kinds.DEPARTURE).any()
    assert results[-1].estimates.column("observable").values[-1] == 1.0


@pytest.mark.parametrize("lost", range(PERIOD))
def test_an_average_is_completed_whichever_place_of_the_period_is_lost_from_now_on(
    lost: int,
) -> None:
    whole, monitor, armed = learnt_sine(), Monitor(model()), 704
    begun = []
    for part in parts(whole, [(first, 1) for first in range(armed + lost, 2560, PERIOD)])[:-1]:
        monitor.update(part)
        begun.append(int(monitor._reference.counts.depth))
    assert begun[0] > 0
    # Samples beside a lost one do not count either.
    assert begun[-1] - begun[0] > 0.75 * (2560 - armed) / PERIOD


@pytest.mark.parametrize("drive", [OTHER_SINE, TRIANGLE, SLOW_SINE], ids=["sine", "tri", "slow"])
def test_a_line_that_loses_every_third_sample_is_not_learnt_until_it_is_mended(
    drive: Shape,
) -> None:
    channels = run(drive, 21.0, friction(19.0), seed=31)
    mended, onset = int(12.0 * RATE), int(19.0 * RATE)
    results = watched([held(channels, [(k, 1) for k in range(0, mended, 3)])])
    armed = results[0].estimates.column("armed").values
    assert not armed[:mended].any()
    # A slow drive repeats after a second, and is learnt for four.
    assert armed[onset - 1] == 1.0
    for name in (kinds.DEPARTURE, kinds.OTHER_FAULT, kinds.DRY_FRICTION):
        assert not raised(results, name)[:onset].any(), name
    assert raised(results, kinds.DRY_FRICTION)[-1] == 1


@pytest.mark.parametrize("step", [5, 6, 7])
def test_a_line_that_loses_samples_has_the_period_of_a_sound_one(step: int) -> None:
    """What repeats nearly after 32 samples does not so much better because few are compared."""
    channels = run(Sine(amplitude=1.2, frequency=RATE / 32.0355), 10.0, seed=31)
    found = []
    for gaps in ([], [(k, 1) for k in range(3, 2000, step)]):
        monitor = Monitor(model())
        monitor.update(held(channels, gaps))
        found.append(int(monitor._reference.counts.period))
    assert found[1] == found[0]


def held(channels: dict[str, np.ndarray], gaps: Gaps) -> SampleBlock:
    """All samples in one block, with those of the gaps flagged as invalid."""
    whole = block(channels)
    quality = np.zeros(len(whole), np.uint8)
    for first, length in gaps:
        quality[first : first + length] = NON_FINITE
    columns = tuple(Column(n, UNITS[n], channels[n].copy(), quality.copy()) for n in UNITS)
    return SampleBlock("rig", 1, 0, whole.device_us, whole.t_ns, columns)


@pytest.mark.parametrize("size", [1, 7])
def test_gaps_give_the_same_for_any_division_into_blocks(size: int) -> None:
    channels = run(SQUARE, 6.0, friction(5.0), seed=33)
    gaps = [*each(61, 1400), (1409, 2), (1413, 1)]
    whole = held(channels, gaps)
    cuts = range(0, len(whole), size)
    blocks = [
        SampleBlock(
            "rig", 1, k, whole.device_us[k : k + size], whole.t_ns[k : k + size],
            tuple(
                Column(c.name, c.unit, c.values[k : k + size], c.quality[k : k + size])
                for c in whole.channels
            ),
        )
        for k in cuts
    ]  # fmt: skip
    (once,), many = watched([whole]), watched(blocks)
    assert once.estimates.column("armed").values[-1] == 1.0
    for name, _, _ in PUBLISHED:
        joined = np.concatenate([one.estimates.column(name).values for one in many])
        assert np.array_equal(joined, once.estimates.column(name).values), name
