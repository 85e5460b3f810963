"""Sensor alarms: the quality flags of a block's channels as conditions, one a channel and flag."""

import numpy as np

from monitor.conditions import Condition
from rigwatch.wire import quality
from rigwatch.wire.messages import SampleBlock

SENSOR_CONDITIONS = {
    quality.NON_FINITE: "sensor_non_finite",
    quality.SATURATED: "sensor_saturated",
    quality.STUCK: "sensor_stuck",
    quality.STALE: "sensor_stale",
    quality.SPIKE: "sensor_spike",
}


def quality_conditions(block: SampleBlock) -> list[Condition]:
    """Conditions `<kind>.<channel>` of every channel that has quality flags.

    `value` is the channel's own value [SI]; there are no limits, since the flag was decided in
    `daq`.
    """
    no_limit = np.full(len(block), np.nan)
    conditions = []
    for channel in block.channels:
        if len(channel.quality) != len(block):
            continue
        for bit, kind in SENSOR_CONDITIONS.items():
            active = ((channel.quality & bit) != 0).astype(np.uint8)
            name = f"{kind}.{channel.name}"
            conditions.append(Condition(name, active, channel.values, no_limit, no_limit))
    return conditions
