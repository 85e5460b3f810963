"""Recordings whose motion hits an end stop, which makes no equation of a free motion right.

A stop throws back what hits it: the strongest acceleration of the recording is at an end of the
travel and away from it, and stands out of the others as nothing in the drive does. The crest
factor, the largest deviation over the root mean square, is that of the drive or less where nothing
is hit, and 2.5 times as large or more where something is.
"""

from collections.abc import Sequence

import numpy as np

from monitor.observer import force_port, layout_of
from monitor.signals import Recording
from rigwatch.physics.engine.equations import Model, measured_states
from rigwatch.wire.arrays import FloatArray

BLOW = 2.0
"""Ratio of the acceleration's crest factor to the drive's above which it is a blow."""
END = 0.1
"""Part of the travel that is an end of it."""
SECOND = 2
"""Order of the motion's derivative that is an acceleration."""


def hit_stops(recordings: Sequence[Recording], model: Model) -> str:
    """What is to be said of the recordings that seem to hit a stop; empty if none does.

    Args:
        recordings: chirps and healthy ones.
        model: says nothing unless its first input drives a motion that is measured beside its
            acceleration.
    """
    layout = layout_of(model, force_port(model))
    column = layout.balance
    if column.order != SECOND or not model.inputs:
        return ""
    names = layout.channels[0], layout.channels[column.channel], layout.channels[-1]
    unit = next(
        model.states[own.name].unit for own in measured_states(model) if own.channel == names[1]
    )
    found = []
    for one in recordings:
        blow = _blow(*(one.channel(name) for name in names))
        if blow is not None:
            at, ratio = blow
            found.append(
                f"{one.name} is thrown back at {at:.3g} {unit} with {ratio:.1f} times the rms of"
                " its acceleration, as from an end stop"
            )
    if not found:
        return ""
    return "; ".join(found) + ": move the middle of the motion or excite it less, and record again"


def _blow(
    drive: FloatArray, position: FloatArray, acceleration: FloatArray
) -> tuple[float, float] | None:
    """Where the motion is thrown back, and the crest factor of its acceleration."""
    at = int(np.argmax(np.abs(acceleration - acceleration.mean())))
    low, high = float(position.min()), float(position.max())
    end = high if acceleration[at] < 0.0 else low
    near = abs(float(position[at]) - end) <= END * (high - low)
    crest = _crest(acceleration)
    return (end, crest) if near and crest > BLOW * _crest(drive) else None


def _crest(signal: FloatArray) -> float:
    """Largest deviation from the mean over the root mean square of all."""
    off = signal - signal.mean()
    return float(np.abs(off).max() / max(np.sqrt(np.mean(off**2)), 1e-300))
