"""Checks the wiring over recordings, before a model is made of them."""

from collections import Counter

import numpy as np

from monitor.signals import Recording
from monitor.wiring.motion_ratio import MotionRatio, motion_ratio
from monitor.wiring.wiring_check import GAIN, PHASE, SCALE, SIGN, window_samples, wrong_wiring
from rigwatch.wire.wiring_names import Wiring


def recorded_wiring(recording: Recording) -> tuple[Wiring, str] | None:
    """What most of a recording's seconds of motion show to be wired wrongly; None if nothing.

    Only a position in m and an acceleration in m/s^2, one each, can be compared.

    Returns:
        the name of the alarm that a monitor raises, and what is wrong in words.
    """
    pair = [[n for n, u in recording.units.items() if u == unit] for unit in ("m", "m/s^2")]
    if any(len(names) != 1 for names in pair):
        return None
    (position,), (acceleration,) = pair
    found = _ratios(recording, position, acceleration)
    reasons = Counter[Wiring](reason for one in found if (reason := wrong_wiring(one)))
    if 2 * reasons.total() <= len(found):
        return None
    reason, _ = reasons.most_common(1)[0]
    gain = float(np.median([one.gain for one in found]))
    phase = float(np.median([abs(one.phase) for one in found]))
    return reason, f"{recording.name}: {_told(reason, position, acceleration, gain, phase)}"


def _ratios(recording: Recording, position: str, acceleration: str) -> list[MotionRatio]:
    """One of each second with motion."""
    x, a, rate = recording.channel(position), recording.channel(acceleration), recording.sample_rate
    length = window_samples(rate)
    starts = range(0, len(x) - length + 1, length)
    windows = (slice(start, start + length) for start in starts)
    found = (motion_ratio(x[window], a[window], rate) for window in windows)
    return [one for one in found if one is not None]


def _told(reason: str, position: str, acceleration: str, gain: float, phase: float) -> str:
    both = f"{acceleration} and the second derivative of {position}"
    if reason == SIGN:
        found = f"{both} of opposite sign ({phase:.0f} degrees apart)"
        expected = "one sign: turn one of the two round, in its wiring or by its gain"
    elif reason == SCALE:
        found = f"{acceleration} {gain:.3g} times the second derivative of {position}"
        expected = f"a factor of 1/{GAIN:g} to {GAIN:g}: correct unit or gain of one of them"
    else:
        found = f"{both} {phase:.0f} degrees apart"
        expected = f"at most {PHASE:g}: channels may be swapped"
    return f"wiring: found {found}, expected {expected}"
