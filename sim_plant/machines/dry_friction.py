"""Dry friction with true sticking (D. Karnopp, 1985), for explicit steps of the speed."""

import numpy as np

from rigwatch.wire.kernel import part


@part(inline="always")
def slid(v: float, drive: float, dry: float, mass: float, h: float) -> float:
    """Speed after a step under a drive and dry friction; zero if friction holds the body.

    Args:
        v: speed now [m/s or rad/s].
        drive: sum of all other forces [N or N m].
        dry: largest friction force [the same].
        mass: mass or inertia.
        h: step [s].
    """
    if dry <= 0.0:
        return v + h * drive / mass
    if v == 0.0:
        if abs(drive) <= dry:
            return 0.0
        return float(h * (drive - np.sign(drive) * dry) / mass)
    later = float(v + h * (drive - np.sign(v) * dry) / mass)
    if np.sign(later) != np.sign(v):
        # The body comes to rest within the step, and moves on only if the drive exceeds friction.
        return 0.0 if abs(drive) <= dry else later
    return later
