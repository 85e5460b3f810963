"""Sensor alarms: quality flags of a block's channels as conditions, one per channel and flag.

A single spike is kept out of the estimates and counted. A condition begins with the third spike
within a second, whether they follow one another or not: a loose contact seldom spikes twice in a
row.
"""

from collections import deque
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from monitor.alarms.debounce import is_zero
from monitor.signals import Condition, level
from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.messages import quality_flags as quality

SENSOR_CONDITIONS = {
    quality.NON_FINITE: "sensor_non_finite",
    quality.SATURATED: "sensor_saturated",
    quality.STUCK: "sensor_stuck",
    quality.STALE: "sensor_stale",
    quality.SPIKE: "sensor_spike",
}
SPIKES = 3
"""Spikes within a second that are a condition."""
Flags = NDArray[np.uint8]


@cache
def _names(channel: str) -> tuple[tuple[int, str], ...]:
    return tuple((bit, f"{kind}.{channel}") for bit, kind in SENSOR_CONDITIONS.items())


@lru_cache(maxsize=1024)
def _none(n: int) -> Flags:
    """No flag in n samples, read only."""
    found = np.zeros(n, np.uint8)
    found.setflags(write=False)
    return found


class SensorFlags:
    """The conditions of the sensors; carries the newest spikes of each channel.

    Args:
        sample_rate: of the rig [Hz].
    """

    def __init__(self, sample_rate: float) -> None:
        self._second = round(sample_rate)
        self._boot = -1
        self._spikes: dict[str, deque[int]] = {}

    def update(self, block: SampleBlock) -> list[Condition]:
        """Conditions `<kind>.<channel>` of every channel that has quality flags.

        `value` is the channel's own value [SI]; there are no limits, as `daq` sets the flags.
        """
        if block.boot != self._boot:
            self._boot, self._spikes = block.boot, {}
        none, no_limit = _none(len(block)), level(len(block), np.nan)
        conditions = []
        for channel in block.channels:
            if len(channel.quality) != len(block):
                continue
            names = _names(channel.name)
            if is_zero(channel.quality) and not self._spikes.get(channel.name):
                rest = none, channel.values, no_limit, no_limit
                conditions += [Condition(name, *rest) for _, name in names]
                continue
            for bit, name in names:
                active = ((channel.quality & bit) != 0).astype(np.uint8)
                if bit == quality.SPIKE:
                    active = self._burst(channel.name, block.seq, active)
                conditions.append(Condition(name, active, channel.values, no_limit, no_limit))
        return conditions

    def is_clean(self, boot: int) -> bool:
        """Whether samples of a boot without a flag change nothing: no spike is remembered."""
        return boot == self._boot and not any(self._spikes.values())

    def _burst(self, channel: str, seq: int, spikes: Flags) -> Flags:
        """Where the newest `SPIKES` spikes lie within a second."""
        newest = self._spikes.setdefault(channel, deque(maxlen=SPIKES))
        if not newest and is_zero(spikes):
            return spikes
        burst = np.zeros_like(spikes)
        for at in range(len(spikes)):
            if spikes[at]:
                newest.append(seq + at)
            burst[at] = len(newest) == SPIKES and seq + at - newest[0] < self._second
        if newest and seq + len(spikes) - newest[-1] > self._second:
            newest.clear()
        return burst
