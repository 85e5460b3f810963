"""Sensor alarms: quality flags of a block's channels as conditions, one per channel and flag."""

from functools import cache

import numpy as np

from monitor.alarms.debounce import is_zero
from monitor.signals import Condition
from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.messages import quality_flags as quality

SENSOR_CONDITIONS = {
    quality.NON_FINITE: "sensor_non_finite",
    quality.SATURATED: "sensor_saturated",
    quality.STUCK: "sensor_stuck",
    quality.STALE: "sensor_stale",
    quality.SPIKE: "sensor_spike",
}


@cache
def _names(channel: str) -> tuple[tuple[int, str], ...]:
    return tuple((bit, f"{kind}.{channel}") for bit, kind in SENSOR_CONDITIONS.items())


def quality_conditions(block: SampleBlock) -> list[Condition]:
    """Conditions `<kind>.<channel>` of every channel that has quality flags.

    `value` is the channel's own value [SI]; there are no limits, as `daq` sets the flags.
    """
    none, no_limit = np.zeros(len(block), np.uint8), np.full(len(block), np.nan)
    conditions = []
    for channel in block.channels:
        if len(channel.quality) != len(block):
            continue
        clean = is_zero(channel.quality)
        for bit, name in _names(channel.name):
            active = none if clean else ((channel.quality & bit) != 0).astype(np.uint8)
            conditions.append(Condition(name, active, channel.values, no_limit, no_limit))
    return conditions
