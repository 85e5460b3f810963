"""Maps the device's clock to Unix time, from each sample's device microseconds.

    t = origin + (us - us0)·1000·(1 + drift) + offset

Line and host delay a sample, and never make it early. So the least delayed sample of every quarter
second counts, and a line touches those of the last minute from below. Its slope is the median of
slopes (Theil and Sen), which ignores the seconds in which the host slept. Where delays scatter too
much to tell it, as those of samples that waited in the line's buffer at the start, the clocks are
taken to agree.

A host that becomes busy delays all samples from then on: a step, no drift, yet it tilts the line.
Certain is only what shows from each eighth of the time to the next.

A jump of the device's clock shows within one sample: its microseconds disagree with its sample
numbers and with the host's clock.

Samples along a line that is known, of a quarter second that has begun, are stamped by a compiled
call; every other one is stamped alone.
"""

import numpy as np
from numpy.typing import NDArray

from daq.adapter import RawBlock
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.host import both_clocks
from rigwatch.wire.kernel import kernel
from rigwatch.wire.shared_numbers import Shared, shared

_BIN_US = 250_000
_BINS = 240
_BINS_FOR_LINE = 8
_BINS_FOR_DRIFT = 80
_PARTS = 8
_FIT_EVERY = 4
"""Quarter seconds from one fit of a line of so many to the next: it hardly changes in a second."""
_USUAL_DRIFT = 1e-3
"""Standard deviation of a drift that is not measured yet."""
_JUMP_PERIODS = 2.5
_WALL_STEP_NS = 500_000_000
MOST_AHEAD_NS = 120_000_000_000
"""How far stamps may be ahead of the host's clock after it was set back [ns]; further, they are set
back too."""
SLOWER = 5e-4
"""By which share stamps run slower until they are right again: hardly a drift."""
_SLOWER_FOR_NS = 100_000_000
"""Longest time that counts so at once [ns]: samples that waited keep their distances."""


_UNIX_NS, _US0, _NS0, _SEQ, _US, _LAST_NS, _COUNT, _END, _EARLIEST = range(9)
"""Places of a clock's numbers in its `place`."""
_NS_PER_US, _PERIOD_US, _SLOPE, _CENTRE, _OFFSET, _LATE = range(6)
"""The same in its `line`."""


class _Newest:
    """The newest of pairs of numbers, one after the other in memory.

    Args:
        most: pairs that are kept.
    """

    def __init__(self, most: int) -> None:
        self._most, self._end = most, 0
        self._pairs = np.empty((2, 2 * most))

    def __len__(self) -> int:
        return min(self._end, self._most)

    @property
    def rows(self) -> FloatArray:
        """The first and second numbers, the newest last, shape (2, any)."""
        return self._pairs[:, self._end - len(self) : self._end]

    def add(self, first: float, second: float) -> None:
        """Keep a pair."""
        if self._end == self._pairs.shape[1]:
            kept = self._most - 1
            self._pairs[:, :kept] = self._pairs[:, -kept:]
            self._end = kept
        self._pairs[:, self._end] = first, second
        self._end += 1


class DeviceClock:
    """Unix time of samples, strictly increasing unless the host's clock is set far back.

    Args:
        rate: nominal sample rate [Hz].
        clock_rate: device microseconds per host microsecond; not 1 in a replay.
        unix_minus_monotonic_ns: difference of the host's two clocks at the start.

    Attributes:
        drift_ppm: how much faster the device's clock runs than the host's [1e-6]; 0 for the first
            20 s, when late arrivals would look like drift.
        certain_drift_ppm: the part of it that delays of the host cannot explain.
        jumps: jumps of the device's clock so far.
        place, line: where it stands, for `stamp_along`.
    """

    _unix_ns = Shared[int]("_place", _UNIX_NS)
    _us0 = Shared[int]("_place", _US0)
    """The anchor of the line: device [µs], host's monotonic time [ns]."""
    _ns0 = Shared[int]("_place", _NS0)
    _seq = Shared[int]("_place", _SEQ)
    """The last sample: number, device's clock [µs], stamp [ns]."""
    _us = Shared[int]("_place", _US)
    _last_ns = Shared[int]("_place", _LAST_NS)
    _count = Shared[int]("_place", _COUNT)
    """Quarter seconds that are known, the unfinished one counted."""
    _end = Shared[int]("_place", _END)
    """The unfinished one: its end after the anchor [µs], and where its least delayed sample lies
    [µs], late by so much [ns]."""
    _earliest = Shared[int]("_place", _EARLIEST)
    _late = Shared[float]("_line", _LATE)
    _ns_per_us = Shared[float]("_line", _NS_PER_US)
    _period_us = Shared[float]("_line", _PERIOD_US)
    _slope = Shared[float]("_line", _SLOPE)
    _centre = Shared[float]("_line", _CENTRE)
    _offset = Shared[float]("_line", _OFFSET)

    def __init__(
        self, rate: float, clock_rate: float = 1.0, unix_minus_monotonic_ns: int = 0
    ) -> None:
        self.drift_ppm = self.certain_drift_ppm = 0.0
        self.jumps = 0
        self._place, self._line = shared(9, np.int64), shared(6, np.float64)
        self.place, self.line = np.asarray(self._place), np.asarray(self._line)
        self._period_us = 1e6 / rate
        self._ns_per_us = 1000.0 / clock_rate
        self._unix_ns = self._wall_ns = unix_minus_monotonic_ns
        self._followed_ns = 0
        self.restart()
        nothing = np.zeros((3, 0), np.int64)
        # Compiled before the first sample arrives.
        stamp_along(self.place, self.line, nothing, 0, nothing[0])

    def restart(self) -> None:
        """Forget the device's clock, as after a restart; time still only moves forward."""
        self._finished = _Newest(_BINS - 1)
        self._since_fit = self._count = 0
        self._slope, self._offset, self._centre = 0.0, 0.0, 0.0

    def stamp(self, run: RawBlock) -> tuple[IntArray, float]:
        """Unix time of each sample of `run` [ns], and its last clock jump [s].

        `run` holds consecutive samples, unwrapped, of one boot.
        """
        samples, stamps = np.empty((3, len(run)), np.int64), np.empty(len(run), np.int64)
        samples[0], samples[1], samples[2] = run.seq, run.device_us, run.arrived_ns
        at = stamp_along(self.place, self.line, samples, 0, stamps)
        return stamps, self.stamp_rest(samples, at, stamps)

    def stamp_rest(self, samples: IntArray, at: int, stamps: IntArray) -> float:
        """Stamp what `stamp_along` has left, from `at` on; the last jump of the clock [s]."""
        jump = 0.0
        while at < len(stamps):
            jump = self._stamp_one(*samples[:, at].tolist()) or jump
            stamps[at] = self._last_ns
            at = stamp_along(self.place, self.line, samples, at + 1, stamps)
        return jump

    def _stamp_one(self, seq: int, us: int, arrived: int) -> float:
        """Stamp one sample with `_last_ns`; the jump of the device's clock before it [s]."""
        jumped = self._jump(seq, us, arrived)
        if jumped:
            self.jumps += 1
            self.restart()
        self._learn(us, arrived)
        self._seq, self._us = seq, us
        self._last_ns = max(self._last_ns + 1, self._unix_ns + self._host_ns(us))
        return jumped

    def follow(self, unix_minus_monotonic_ns: int, monotonic_ns: int) -> float:
        """Step of the host's wall clock since the last call [s], 0 if there was none.

        A step forward is followed at once. After a step back stamps are ahead: they run slower
        until they are right again, or are set back, once, if that would take more than days.
        """
        since_ns = monotonic_ns - self._followed_ns
        self._followed_ns = monotonic_ns
        step = unix_minus_monotonic_ns - self._wall_ns
        if abs(step) < _WALL_STEP_NS:
            slower_ns = round(SLOWER * min(max(since_ns, 0), _SLOWER_FOR_NS))
            self._unix_ns -= min(slower_ns, self._ahead_ns)
            return 0.0
        self._wall_ns = unix_minus_monotonic_ns
        if self._ahead_ns > MOST_AHEAD_NS:
            self._last_ns -= self._ahead_ns
            self._unix_ns = self._wall_ns
        self._unix_ns = max(self._unix_ns, self._wall_ns)
        return step * 1e-9

    def agrees(self, unix_minus_monotonic_ns: int) -> bool:
        """Whether `follow` has nothing to do."""
        step = unix_minus_monotonic_ns - self._wall_ns
        return abs(step) < _WALL_STEP_NS and self._ahead_ns == 0

    @property
    def ahead_s(self) -> float:
        """How far stamps are ahead of the host's clock, since it was set back [s]."""
        return self._ahead_ns * 1e-9

    @property
    def _ahead_ns(self) -> int:
        return self._unix_ns - self._wall_ns

    def unix_ns(self, monotonic_ns: int) -> int:
        """Unix time of a moment on the host's monotonic clock [ns]."""
        return self._unix_ns + monotonic_ns

    def _host_ns(self, us: int) -> int:
        """Monotonic host time at which the device's clock read `us` [ns]."""
        relative = us - self._us0
        late = self._offset + self._slope * (relative - self._centre)
        return self._ns0 + round(relative * self._ns_per_us + late)

    def _jump(self, seq: int, us: int, arrived: int) -> float:
        """Jump of the device's clock before this sample [s], 0 if there was none."""
        if not self._count:
            return 0.0
        odd_us = us - self._us - (seq - self._seq) * self._period_us
        if abs(odd_us) < _JUMP_PERIODS * self._period_us:
            return 0.0
        late_us = (arrived - self._host_ns(us)) / self._ns_per_us
        agrees = -late_us * np.sign(odd_us) > 0.5 * abs(odd_us)
        return odd_us * 1e-6 if agrees else 0.0

    def _learn(self, us: int, arrived: int) -> None:
        if not self._count:
            self._us0, self._ns0 = us, arrived
        relative = us - self._us0
        late = arrived - self._ns0 - relative * self._ns_per_us
        if self._count and relative < self._end:
            if late < self._late:
                self._earliest, self._late = relative, late
        else:
            self._begin_bin(relative, late)
        if self._count < _BINS_FOR_LINE:
            self._offset = min([self._late, *self._finished.rows[1].tolist()])

    def _begin_bin(self, relative: int, late: float) -> None:
        """Begin a quarter second with this sample, and refit the line where it is time to."""
        if self._count:
            self._finished.add(self._earliest, self._late)
        self._earliest, self._late = relative, late
        self._end = relative // _BIN_US * _BIN_US + _BIN_US
        self._count, self._since_fit = len(self._finished) + 1, self._since_fit + 1
        if self._count <= _BINS_FOR_DRIFT or self._since_fit >= _FIT_EVERY:
            self._since_fit = 0
            self._fit()

    def _fit(self) -> None:
        """Refit the line; the newest, unfinished quarter second does not count yet."""
        if self._count <= _BINS_FOR_LINE:
            return
        relative, late = self._finished.rows
        self._slope = _likely_slope(relative, late / self._ns_per_us) * self._ns_per_us
        self._centre = float(relative[-1])
        self._offset = float(np.min(late - self._slope * (relative - self._centre)))
        if self._count > _BINS_FOR_DRIFT:
            self.drift_ppm = self._ppm(self._slope)
            self.certain_drift_ppm = self._ppm(_common_slope(relative, late, self._slope))

    def _ppm(self, slope: float) -> float:
        """Drift of the device's clock if samples come later by `slope` [ns] each microsecond."""
        return 1e6 * (self._ns_per_us / (self._ns_per_us + slope) - 1.0)


@kernel()
def stamp_along(
    place: IntArray, line: FloatArray, samples: IntArray, at: int, stamps: IntArray
) -> int:
    """Stamp samples from `at` on, up to one that jumps or begins another quarter second.

    Args:
        place, line: of the clock.
        samples: shape (3, n): numbers, device's clock [µs], arrival [ns].
        at: the first to be stamped.
        stamps: shape (n,), filled: Unix time [ns].

    Returns:
        The first one that is not stamped: `at` as long as no line is known.
    """
    if place[_COUNT] < _BINS_FOR_LINE:
        return at
    ns_per_us, period_us = line[_NS_PER_US], line[_PERIOD_US]
    slope, centre, offset = line[_SLOPE], line[_CENTRE], line[_OFFSET]
    while at < stamps.size:
        seq, us, arrived = samples[0, at], samples[1, at], samples[2, at]
        odd_us = us - place[_US] - (seq - place[_SEQ]) * period_us
        relative = us - place[_US0]
        if abs(odd_us) >= _JUMP_PERIODS * period_us or relative >= place[_END]:
            break
        late = arrived - place[_NS0] - relative * ns_per_us
        if late < line[_LATE]:
            place[_EARLIEST], line[_LATE] = relative, late
        place[_SEQ], place[_US] = seq, us
        along = relative * ns_per_us + (offset + slope * (relative - centre))
        ns = place[_UNIX_NS] + place[_NS0] + int(np.rint(along))
        place[_LAST_NS] = stamps[at] = max(place[_LAST_NS] + 1, ns)
        at += 1
    return at


def _likely_slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median slope, the nearer to none the less the points tell of it."""
    slope = _median_slope(x, y)
    rest = y - slope * x
    scatter = 1.4826 * _median(np.abs(rest - _median(rest)))
    deviation = scatter * (12.0 / len(x)) ** 0.5 / (x[-1] - x[0])
    return float(slope / (1.0 + (deviation / _USUAL_DRIFT) ** 2))


def _median_slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median of slopes between points half the span apart, which needs n/2 of them and not n²."""
    half = len(x) // 2
    return _median((y[half : 2 * half] - y[:half]) / (x[half : 2 * half] - x[:half]))


def _median(values: NDArray[np.float64]) -> float:
    """numpy's takes five times as long for some hundred values."""
    middle, odd = divmod(len(values), 2)
    if odd:
        return float(np.partition(values, middle)[middle])
    low, high = np.partition(values, (middle - 1, middle))[middle - 1 : middle + 1]
    return float((low + high) / 2.0)


def _common_slope(x: NDArray[np.float64], y: NDArray[np.float64], slope: float) -> float:
    """The least slope from one part's earliest point to the next part's; 0 if they differ in sign.

    Earliest are the points that lie lowest under a line of this slope.
    """
    each, longer = divmod(len(x), _PARTS)
    sizes = np.full(_PARTS, each)
    sizes[:longer] += 1
    starts = np.cumsum(sizes) - sizes
    middle = np.add.reduceat(x, starts) / sizes
    lowest = np.minimum.reduceat(y - slope * x, starts)
    slopes = slope + (lowest[1:] - lowest[:-1]) / (middle[1:] - middle[:-1])
    least = float(slopes[np.argmin(np.abs(slopes))])
    return least if np.all(slopes * least > 0.0) else 0.0


def host_offset_ns() -> int:
    """Unix time less monotonic time of the host [ns]."""
    wall, steady = both_clocks()
    return wall - steady
