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

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.adapter import RawBlock
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.host import both_clocks
from rigwatch.wire.kernel import kernel

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


class _Line(NamedTuple):
    """The line of `DeviceClock` from an anchor: device [µs], host's monotonic time [ns]."""

    us0: int
    ns0: int
    unix_ns: int
    ns_per_us: float
    slope: float
    centre: float
    offset: float
    period_us: float


class _Place(NamedTuple):
    """The last sample: number, device's clock [µs], stamp [ns]; and its quarter second: where it
    ends after the anchor [µs], and where its least delayed sample lies [µs], late by so much [ns].
    """

    seq: int
    us: int
    ns: int
    end: int
    earliest: int
    late: float


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
    """

    def __init__(
        self, rate: float, clock_rate: float = 1.0, unix_minus_monotonic_ns: int = 0
    ) -> None:
        self.drift_ppm = self.certain_drift_ppm = 0.0
        self.jumps = 0
        self._period_us = 1e6 / rate
        self._ns_per_us = 1000.0 / clock_rate
        self._unix_ns = self._wall_ns = unix_minus_monotonic_ns
        self._followed_ns = self._last_ns = 0
        self._last: tuple[int, int] | None = None
        self.restart()
        nothing = np.zeros((3, 0), np.int64)
        line = _Line(0, 0, 0, self._ns_per_us, 0.0, 0.0, 0.0, self._period_us)
        # Compiled before the first sample arrives.
        _stamp_line(nothing, 0, line, _Place(0, 0, 0, 0, 0, 0.0), nothing[0])

    def restart(self) -> None:
        """Forget the device's clock, as after a restart; time still only moves forward."""
        self._bins: deque[tuple[int, float]] = deque(maxlen=_BINS)
        self._since_fit = 0
        self._anchor: tuple[int, int] | None = None
        self._slope, self._offset, self._centre = 0.0, 0.0, 0.0
        self._last = None

    def stamp(self, run: RawBlock) -> tuple[IntArray, float]:
        """Unix time of each sample of `run` [ns], and its last clock jump [s].

        `run` holds consecutive samples, unwrapped, of one boot.
        """
        samples, jump, at = np.empty((3, len(run)), np.int64), 0.0, 0
        samples[0], samples[1], samples[2] = run.seq, run.device_us, run.arrived_ns
        stamps = np.empty(len(run), np.int64)
        while (at := self._stamp_along(samples, at, stamps)) < len(stamps):
            jump = self._stamp_one(*samples[:, at].tolist()) or jump
            stamps[at] = self._last_ns
            at += 1
        return stamps, jump

    def _stamp_along(self, samples: IntArray, at: int, stamps: IntArray) -> int:
        """Stamp samples from `at` on while they lie along the line; the first that does not."""
        if self._anchor is None or self._last is None or len(self._bins) < _BINS_FOR_LINE:
            return at
        earliest, late = self._bins[-1]
        slope, centre, offset = self._slope, self._centre, self._offset
        line = _Line(
            *self._anchor, self._unix_ns, self._ns_per_us, slope, centre, offset, self._period_us
        )
        place = _Place(*self._last, self._last_ns, _bin_end(earliest), earliest, late)
        at, seq, us, self._last_ns, earliest, late = _stamp_line(samples, at, line, place, stamps)
        self._last, self._bins[-1] = (seq, us), (earliest, late)
        return at

    def _stamp_one(self, seq: int, us: int, arrived: int) -> float:
        """Stamp one sample with `_last_ns`; the jump of the device's clock before it [s]."""
        jumped = self._jump(seq, us, arrived)
        if jumped:
            self.jumps += 1
            self.restart()
        self._learn(us, arrived)
        self._last = (seq, us)
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
        us0, ns0 = self._anchor or (us, 0)
        relative = us - us0
        late = self._offset + self._slope * (relative - self._centre)
        return ns0 + round(relative * self._ns_per_us + late)

    def _jump(self, seq: int, us: int, arrived: int) -> float:
        """Jump of the device's clock before this sample [s], 0 if there was none."""
        if self._last is None:
            return 0.0
        last_seq, last_us = self._last
        odd_us = us - last_us - (seq - last_seq) * self._period_us
        if abs(odd_us) < _JUMP_PERIODS * self._period_us:
            return 0.0
        late_us = (arrived - self._host_ns(us)) / self._ns_per_us
        agrees = -late_us * np.sign(odd_us) > 0.5 * abs(odd_us)
        return odd_us * 1e-6 if agrees else 0.0

    def _learn(self, us: int, arrived: int) -> None:
        if self._anchor is None:
            self._anchor = (us, arrived)
        us0, ns0 = self._anchor
        relative = us - us0
        late = arrived - ns0 - relative * self._ns_per_us
        if self._bins and relative < _bin_end(self._bins[-1][0]):
            if late < self._bins[-1][1]:
                self._bins[-1] = (relative, late)
        else:
            self._bins.append((relative, late))
            self._since_fit += 1
            if len(self._bins) <= _BINS_FOR_DRIFT or self._since_fit >= _FIT_EVERY:
                self._since_fit = 0
                self._fit()
        if len(self._bins) < _BINS_FOR_LINE:
            self._offset = min(late for _, late in self._bins)

    def _fit(self) -> None:
        """Refit the line; the newest, unfinished quarter second does not count yet."""
        if len(self._bins) <= _BINS_FOR_LINE:
            return
        relative, late = np.array(self._bins)[:-1].T
        self._slope = _likely_slope(relative, late / self._ns_per_us) * self._ns_per_us
        self._centre = float(relative[-1])
        self._offset = float(np.min(late - self._slope * (relative - self._centre)))
        if len(self._bins) > _BINS_FOR_DRIFT:
            self.drift_ppm = self._ppm(self._slope)
            self.certain_drift_ppm = self._ppm(_common_slope(relative, late, self._slope))

    def _ppm(self, slope: float) -> float:
        """Drift of the device's clock if samples come later by `slope` [ns] each microsecond."""
        return 1e6 * (self._ns_per_us / (self._ns_per_us + slope) - 1.0)


def _bin_end(relative: int) -> int:
    """Where the quarter second of a sample ends, both after the anchor [µs]."""
    return relative // _BIN_US * _BIN_US + _BIN_US


@kernel()
def _stamp_line(
    samples: IntArray, at: int, line: _Line, place: _Place, stamps: IntArray
) -> tuple[int, int, int, int, int, float]:
    """Stamp samples from `at` on, up to one that jumps or begins another quarter second.

    Args:
        samples: shape (3, n): numbers, device's clock [µs], arrival [ns].
        at: the first to be stamped.
        line, place: before it.
        stamps: shape (n,), filled: Unix time [ns].

    Returns:
        The first one that is not stamped, and the place before it without the quarter's end.
    """
    seq, us, ns = place.seq, place.us, place.ns
    earliest, least = place.earliest, place.late
    while at < stamps.size:
        odd_us = samples[1, at] - us - (samples[0, at] - seq) * line.period_us
        relative = samples[1, at] - line.us0
        if abs(odd_us) >= _JUMP_PERIODS * line.period_us or relative >= place.end:
            break
        late = samples[2, at] - line.ns0 - relative * line.ns_per_us
        if late < least:
            earliest, least = relative, late
        seq, us = samples[0, at], samples[1, at]
        along = relative * line.ns_per_us + (line.offset + line.slope * (relative - line.centre))
        ns = max(ns + 1, line.unix_ns + line.ns0 + int(np.rint(along)))
        stamps[at] = ns
        at += 1
    return at, seq, us, ns, earliest, least


def _likely_slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median slope, the nearer to none the less the points tell of it."""
    slope = _median_slope(x, y)
    rest = y - slope * x
    scatter = 1.4826 * float(np.median(np.abs(rest - np.median(rest))))
    deviation = scatter * (12.0 / len(x)) ** 0.5 / (x[-1] - x[0])
    return float(slope / (1.0 + (deviation / _USUAL_DRIFT) ** 2))


def _median_slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median of slopes between points half the span apart, which needs n/2 of them and not n²."""
    half = len(x) // 2
    return float(np.median((y[half : 2 * half] - y[:half]) / (x[half : 2 * half] - x[:half])))


def _common_slope(x: NDArray[np.float64], y: NDArray[np.float64], slope: float) -> float:
    """The least slope from one part's earliest point to the next part's; 0 if they differ in sign.

    Earliest are the points that lie lowest under a line of this slope.
    """
    parts = zip(np.array_split(x, _PARTS), np.array_split(y - slope * x, _PARTS), strict=True)
    middle, lowest = np.array([(part_x.mean(), part_y.min()) for part_x, part_y in parts]).T
    slopes = slope + np.diff(lowest) / np.diff(middle)
    least = float(slopes[np.argmin(np.abs(slopes))])
    return least if np.all(slopes * least > 0.0) else 0.0


def host_offset_ns() -> int:
    """Unix time less monotonic time of the host [ns]."""
    wall, steady = both_clocks()
    return wall - steady
