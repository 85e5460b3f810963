"""Source of a server's samples, and the schedule of their due times.

`Device` numbers the samples as a real one does: a boot drawn at its start, counters of 32 bits that
wrap. Faults of the device itself (a restart, a clock that drifts or jumps) are switched here;
faults of the line in `line_faults.py`.
"""

import secrets
import time
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

_U32 = 1 << 32


class Samples(Protocol):
    """Codes of n samples; `sim_plant.rig.RawSamples` is one."""

    @property
    def device_us(self) -> NDArray[np.int64]:
        """Device clock [µs], shape (n,)."""

    @property
    def codes(self) -> NDArray[np.int16]:
        """Raw codes, shape (n, channels)."""


class Source(Protocol):
    """A simulation that runs sample by sample, such as `ScenarioRun`."""

    def advance(self, n: int, /) -> Any:
        """The next n samples, of class `Samples`."""


@dataclass(frozen=True, slots=True)
class Sent:
    """Samples as the device numbers them: `boot`, `seq` and `device_us` wrapped to 32 bits."""

    boot: int
    seq: NDArray[np.int64]
    device_us: NDArray[np.int64]
    codes: NDArray[np.int16]

    def __len__(self) -> int:
        return len(self.seq)


class Device:
    """A source with a boot, counters and a clock that can go wrong.

    Args:
        source: gives codes and true times.
        first_seq: number of the first sample, near 2³² to see it wrap.
        first_us: device clock at the first sample [µs].
    """

    def __init__(self, source: Source, first_seq: int = 0, first_us: int = 0) -> None:
        self._source = source
        self.boot = secrets.randbits(32)
        self._seq = first_seq
        self._us = first_us
        self._previous_us: int | None = None
        self._clock = float(first_us)
        self.drift_ppm = 0.0

    @property
    def next_seq(self) -> int:
        """Number of the sample that comes next, not wrapped."""
        return self._seq

    def advance(self, n: int) -> Sent:
        """The next n samples."""
        samples = self._source.advance(n)
        true_us = np.asarray(samples.device_us, np.int64)
        start = int(true_us[0]) if self._previous_us is None else self._previous_us
        elapsed = (true_us - start) * (1.0 + 1e-6 * self.drift_ppm)
        clock = self._clock + elapsed
        self._clock, self._previous_us = float(clock[-1]), int(true_us[-1])
        seq = np.arange(self._seq, self._seq + n)
        self._seq += n
        return Sent(self.boot, seq % _U32, np.rint(clock).astype(np.int64) % _U32, samples.codes)

    def restart(self, *, keep_boot: bool = False, first_seq: int = 0) -> None:
        """Count anew from `first_seq`, with a new boot as a real device unless `keep_boot`."""
        self.boot = self.boot if keep_boot else secrets.randbits(32)
        self._seq, self._clock = first_seq, 0.0

    def jump_clock(self, seconds: float) -> None:
        """Step the device's clock."""
        self._clock += 1e6 * seconds


class Pace:
    """How many samples are due by now, on an absolute schedule that does not drift.

    Args:
        rate: samples a second [Hz].
        max_backlog: after a standstill longer than this [s] the schedule restarts, as a
            device that was off does not catch up on missed samples.
    """

    def __init__(self, rate: float, max_backlog: float = 1.0) -> None:
        self._period_ns = 1e9 / rate
        self._max_ns = max_backlog * 1e9
        self._start = time.monotonic_ns()
        self._given = 0

    def due(self) -> int:
        """Samples due since the last call."""
        behind = time.monotonic_ns() - self._start - self._given * self._period_ns
        if behind > self._max_ns:
            self._start += int(behind)
            behind = 0.0
        count = int(behind / self._period_ns) + (behind >= 0.0)
        self._given += count
        return count

    def until_next(self) -> float:
        """Time until the next sample is due [s], 0 when one is due."""
        next_ns = self._start + self._given * self._period_ns
        return max(0.0, (next_ns - time.monotonic_ns()) * 1e-9)
