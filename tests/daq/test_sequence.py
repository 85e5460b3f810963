"""Every sample is delivered once or told as lost, whatever happens to the numbers on the way."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from daq.adapter import RawBlock
from daq.sequence import Hole, Restart, SequenceTracker

PERIOD_US = 1e6 / 256


def raw_of(seqs: list[int], boot: int = 1, us_offset: int = 0) -> RawBlock:
    seq = np.array(seqs, np.int64)
    us = np.rint(seq * PERIOD_US).astype(np.int64) + us_offset
    codes = np.stack([seq % 2**32 % 1000, -(seq % 1000)], axis=1)
    return RawBlock(boot, seq % 2**32, us % 2**32, codes, us * 1000)


def delivered(tracker: SequenceTracker, *blocks: RawBlock) -> tuple[list[int], list[int]]:
    """Numbers delivered, and numbers told as lost."""
    numbers, lost = [], []
    for block in blocks:
        for step in tracker.accept(block):
            if isinstance(step, RawBlock):
                assert (np.diff(step.seq) == 1).all()
                np.testing.assert_array_equal(step.codes[:, 0], step.seq % 2**32 % 1000)
                numbers += step.seq.tolist()
            elif isinstance(step, Hole):
                lost += range(step.first, step.last + 1)
    return numbers, lost


@given(
    st.integers(0, 2**33),
    st.lists(st.sampled_from(["keep", "lose", "twice", "again"]), min_size=1, max_size=40),
    st.lists(st.integers(1, 9), min_size=1),
)
def test_any_losses_and_repetitions(first: int, fates: list[str], cuts: list[int]) -> None:
    seqs, at = [first], first
    for fate in fates:
        at += 1
        seqs += {"keep": [at], "lose": [], "twice": [at, at], "again": [at, max(at - 3, first)]}[
            fate
        ]
    tracker, numbers, lost, start, turn = SequenceTracker(256.0), [], [], 0, 0
    while start < len(seqs):
        stop = start + cuts[turn % len(cuts)]
        good, holes = delivered(tracker, raw_of(seqs[start:stop]))
        numbers, lost, start, turn = numbers + good, lost + holes, stop, turn + 1
    assert sorted(numbers + lost) == list(range(numbers[0], numbers[-1] + 1))
    assert tracker.duplicates == len(seqs) - len(numbers)
    assert tracker.lost == len(lost)


class SampleBySample(SequenceTracker):
    """Takes no short way for blocks of samples that simply follow."""

    def _next_ones(self, raw: RawBlock) -> RawBlock | None:
        return None


@given(
    st.integers(0, 2**33),
    st.integers(-(2**32), 2**32),
    st.lists(
        st.tuples(
            st.integers(1, 9),
            st.sampled_from([0, 0, 0, -3, -1, 2]),
            st.integers(-1000, 1000),
            st.sampled_from([1, 1, 1, 1, 2]),
        ),
        min_size=1,
        max_size=60,
    ),
)
def test_whole_blocks_are_placed_as_sample_by_sample(
    first: int, us_offset: int, blocks: list[tuple[int, int, int, int]]
) -> None:
    quick, careful = SequenceTracker(256.0), SampleBySample(256.0)
    for count, lost, late_us, boot in blocks:
        first = max(0, first + lost)
        raw = raw_of([*range(first, first + count)], boot, us_offset + late_us)
        first += count
        for one, other in zip(quick.accept(raw), careful.accept(raw), strict=True):
            if not isinstance(one, RawBlock):
                assert one == other
                continue
            assert isinstance(other, RawBlock)
            assert (one.boot, one.calibrated) == (other.boot, other.calibrated)
            for name in ("seq", "device_us", "codes", "arrived_ns", "quality"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert vars(quick) == vars(careful)


def test_microseconds_are_unwrapped_over_a_long_silence() -> None:
    tracker = SequenceTracker(256.0)
    hours = 256 * 3600 * 5
    (first,) = [s for s in tracker.accept(raw_of([0])) if isinstance(s, RawBlock)]
    (later,) = [s for s in tracker.accept(raw_of([hours])) if isinstance(s, RawBlock)]
    assert later.device_us[0] - first.device_us[0] == 5 * 3600 * 1_000_000
    assert tracker.lost == hours - 1


def test_a_new_boot_is_a_hole_of_unknown_length() -> None:
    tracker = SequenceTracker(256.0)
    tracker.accept(raw_of([7, 8]))
    hole, restart, run = tracker.accept(raw_of([3, 4], boot=2))
    assert hole == Hole(1, 9, 8)
    assert restart == Restart(2, 1, "the device has started anew")
    assert isinstance(run, RawBlock)
    assert (run.boot, run.seq.tolist()) == (2, [3, 4])


def test_a_count_that_begins_again_with_the_same_boot_gets_another() -> None:
    tracker = SequenceTracker(256.0)
    tracker.accept(raw_of([5000, 5001]))
    steps = tracker.accept(raw_of([0, 1], us_offset=round(5002 * PERIOD_US)))
    assert [type(step) for step in steps] == [Hole, Restart, RawBlock]
    assert steps[-1].boot not in (1, 0)  # type: ignore[union-attr]
    again = tracker.accept(raw_of([2], us_offset=round(5002 * PERIOD_US)))
    assert [step.boot for step in again] == [steps[-1].boot]  # type: ignore[union-attr]


def test_what_looks_repeated_at_the_start_of_a_new_count_is_told_as_lost() -> None:
    """Within four seconds of its start a device without boot numbers sends what it sent before."""
    tracker = SequenceTracker(256.0)
    tracker.accept(raw_of(list(range(500))))
    steps = [step for seq in range(100) for step in tracker.accept(raw_of([seq]))]
    restart = next(step for step in steps if isinstance(step, Restart))
    runs = [step for step in steps if isinstance(step, RawBlock)]
    holes = [step for step in steps if isinstance(step, Hole)]
    assert runs[0].boot == restart.boot != 1
    first = int(runs[0].seq[0])
    assert holes == [Hole(1, 500, 499), Hole(restart.boot, 0, first - 1)]
    assert sum(map(len, runs)) + tracker.lost == 100
    assert tracker.duplicates == 0


def test_a_sample_that_is_sent_again_and_again_is_not_lost() -> None:
    tracker = SequenceTracker(256.0)
    tracker.accept(raw_of(list(range(100))))
    for _ in range(70):
        tracker.accept(raw_of([98]))
    assert tracker.lost == 0


def test_of_two_devices_on_one_line_one_is_read_and_the_other_counted() -> None:
    tracker = SequenceTracker(256.0)
    steps = []
    for first in range(0, 512, 8):  # both take turns for two seconds
        for boot in (1, 2):
            steps += tracker.accept(raw_of([*range(first, first + 8)], boot))
    assert [step.boot for step in steps if isinstance(step, Restart)] == [1, 2]
    assert tracker.foreign == 512 - 8
    later = [*range(512, 1280, 8)]  # the second is unplugged, and the first goes on
    back = [step for at in later for step in tracker.accept(raw_of([*range(at, at + 8)], 1))]
    assert [step.boot for step in back if isinstance(step, Restart)] == [1]
    read = [seq for step in back if isinstance(step, RawBlock) for seq in step.seq.tolist()]
    assert read == [*range(1023, 1280)]
