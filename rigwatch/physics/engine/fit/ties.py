"""Ties: parameter combinations that a recording does not determine.

Where a search ends along such a direction depends on its start, and so does the error on other
recordings. A prior resolves this independently of the start: each parameter is near its value in
the model file, with a standard deviation of the same size. It acts only along the ties (maximum a
posteriori), so parameters determined by the recording are unaffected. A fit without ties is
unchanged.
"""

from collections.abc import Callable, Mapping

import numpy as np

from rigwatch.physics.engine.fit.windowed_fit import Fit, Prior
from rigwatch.wire.arrays import FloatArray

LOOSE = 0.3
"""Relative standard deviation of a parameter combination above which it counts as a tie."""
UNSEEN = 10.0
"""The same for a single parameter."""
HEAVY = 0.3
"""Share of a direction above which a parameter belongs to it."""
ROUNDS = 12
"""Most fits, as ties may be curved."""
CLOSE = 0.01
"""Relative change below which no further fit is made."""
COSTS = 0.05
"""Relative rise of the error at which what seemed a tie is none: it is flat to first order only."""


def untied(
    found: Fit,
    centre: Mapping[str, float],
    nearby: Callable[[Fit, Prior], Fit],
    judged: Callable[[Fit], float] | None = None,
) -> Fit:
    """The fit with its ties resolved; unchanged if there are none.

    Args:
        found: the fit.
        centre: prior means of the parameters, by name.
        nearby: moves a fit to where a prior and the recording agree best.
        judged: error of a fit that must not rise; that of its scaled residuals if None.

    Raises:
        ModelError: the model diverges.
    """
    names = found.compiled.system.free
    about = np.array([centre[name] for name in names])
    unit = _units(about, _values(found))
    error, allowed = judged or _noise, 0.0
    for _ in range(ROUNDS):
        at = _values(found)
        size = np.maximum(unit * (about != 0), np.abs(at))
        flat = _flat(found, np.where(size > 0, size, 1.0))
        if not flat.shape[1]:
            break
        # Without a tie the error, which may take a simulation, is not needed.
        allowed = allowed or error(found) * (1 + COSTS)
        # Of all equivalent parameters, those nearest to the prior means.
        basis = np.linalg.qr(flat / unit[:, None]).Q
        prior = Prior(about, _noise(found) * basis.T / unit)
        tried = nearby(found, prior)
        if error(tried) > allowed:
            break
        found = tried
        if np.max(np.abs(_values(found) - at) / unit) < CLOSE:
            break
    return found


def _units(about: FloatArray, at: FloatArray) -> FloatArray:
    """What counts as large of each parameter: a strength of which the mean is 0 has its own size.

    A newton for all would pull a force of 100 kN to zero where the error is flat to first order
    only. Small strengths are held loosely, at 1 in SI units.
    """
    return np.where(about != 0, np.abs(about), np.maximum(np.abs(at), 1.0))


def _values(found: Fit) -> FloatArray:
    """Free parameters, shape (m,)."""
    values = found.values()
    return np.array([values[name] for name in found.compiled.system.free])


def _noise(found: Fit) -> float:
    return max(float(np.sqrt(np.mean(found.error**2))), 1e-300)


def _flat(found: Fit, size: FloatArray) -> FloatArray:
    """Directions whose standard deviation exceeds the parameters' sizes, shape (m, directions)."""
    if not len(size):
        return np.zeros((0, 0))
    slopes = found.jacobian.reshape(-1, len(size)) * size
    values, directions = np.linalg.eigh(slopes.T @ slopes)
    deviations = _noise(found) / np.sqrt(np.maximum(values, 1e-300))
    together = np.sum(np.abs(directions) > HEAVY, axis=0) > 1
    loose = deviations > np.where(together, LOOSE, UNSEEN)
    return np.asarray(directions[:, loose] * size[:, None])
