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
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from daq.adapter import RawBlock
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.host import both_clocks

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


class DeviceClock:
    """Unix time of samples, strictly increasing.

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
        self._last_ns = 0
        self._last: tuple[int, int] | None = None
        self.restart()

    def restart(self) -> None:
        """Forget the device's clock, as after a restart; time still only moves forward."""
        self._bins: deque[tuple[float, float]] = deque(maxlen=_BINS)
        self._since_fit = 0
        self._anchor: tuple[int, int] | None = None
        self._slope, self._offset, self._centre = 0.0, 0.0, 0.0
        self._last = None

    def stamp(self, run: RawBlock) -> tuple[IntArray, float]:
        """Unix time of each sample of `run` [ns], and its last clock jump [s].

        `run` holds consecutive samples, unwrapped, of one boot.
        """
        rows = zip(run.seq.tolist(), run.device_us.tolist(), run.arrived_ns.tolist(), strict=True)
        stamps, jump = [], 0.0
        for seq, us, arrived in rows:
            jumped = self._jump(seq, us, arrived)
            if jumped:
                jump = jumped
                self.jumps += 1
                self.restart()
            self._learn(us, arrived)
            self._last = (seq, us)
            self._last_ns = max(self._last_ns + 1, self._unix_ns + self._host_ns(us))
            stamps.append(self._last_ns)
        return np.array(stamps, np.int64), jump

    def follow(self, unix_minus_monotonic_ns: int) -> float:
        """Step of the host's wall clock since the last call [s], 0 if there was none.

        A step forward is followed. A step back is not: time in a recording only moves forward.
        """
        step = unix_minus_monotonic_ns - self._wall_ns
        if abs(step) < _WALL_STEP_NS:
            return 0.0
        self._wall_ns = unix_minus_monotonic_ns
        self._unix_ns = max(self._unix_ns, unix_minus_monotonic_ns)
        return step * 1e-9

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
        if self._bins and relative < self._bins[-1][0] // _BIN_US * _BIN_US + _BIN_US:
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
