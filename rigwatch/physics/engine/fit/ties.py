"""Ties: directions in which parameters can move together without the recording telling.

Where a search ends along them is an accident of its start, and so is the error elsewhere. A prior
settles it, the same for every start: each parameter lies about the value that its model was written
with, give or take as much. It acts along the ties alone (maximum a posteriori), so that what the
recording does tell stays as it was. A fit without a tie is left as it is.
"""

from collections.abc import Mapping

import numpy as np

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import Fit, Prior, fit
from rigwatch.wire.arrays import FloatArray

LOOSE = 0.3
"""Deviation of a combination of parameters, over their sizes, from which it counts as a tie."""
UNSEEN = 10.0
"""The same of one parameter alone."""
HEAVY = 0.3
"""Share of a direction from which a parameter is part of it."""
ROUNDS = 12
"""Fits at most, as ties may be bent."""
CLOSE = 0.01
"""Change over the sizes at which a further fit is not worth it."""


def untied(
    found: Fit, recording: Recording, horizon: int, centre: Mapping[str, float], substeps: int
) -> Fit:
    """The fit with its ties settled; itself where there is none.

    Args:
        found: the fit.
        recording, horizon, substeps: what it was fitted to, see `fit`.
        centre: where parameters probably are, by name.

    Raises:
        ModelError: the model diverges.
    """
    names = found.compiled.system.free
    about = np.array([centre[name] for name in names])
    unit = np.where(about != 0, np.abs(about), 1.0)
    for _ in range(ROUNDS):
        at = _values(found)
        size = np.maximum(unit * (about != 0), np.abs(at))
        flat = _flat(found, np.where(size > 0, size, 1.0))
        if not flat.shape[1]:
            break
        # Of all that the recording takes for equal, the nearest to where parameters probably are.
        basis = np.linalg.qr(flat / unit[:, None]).Q
        prior = Prior(about, _noise(found) * basis.T / unit)
        found = fit(
            found.compiled, recording, horizon, start=found.parameters, scale=found.scale,
            initial=found.initial, substeps=substeps, prior=prior,
        )  # fmt: skip
        if np.max(np.abs(_values(found) - at) / unit) < CLOSE:
            break
    return found


def _values(found: Fit) -> FloatArray:
    """Free parameters, shape (m,)."""
    values = found.values()
    return np.array([values[name] for name in found.compiled.system.free])


def _noise(found: Fit) -> float:
    return max(float(np.sqrt(np.mean(found.error**2))), 1e-300)


def _flat(found: Fit, size: FloatArray) -> FloatArray:
    """Directions of the parameters that are told worse than their sizes, shape (m, directions)."""
    if not len(size):
        return np.zeros((0, 0))
    slopes = found.jacobian.reshape(-1, len(size)) * size
    values, directions = np.linalg.eigh(slopes.T @ slopes)
    deviations = _noise(found) / np.sqrt(np.maximum(values, 1e-300))
    together = np.sum(np.abs(directions) > HEAVY, axis=0) > 1
    loose = deviations > np.where(together, LOOSE, UNSEEN)
    return np.asarray(directions[:, loose] * size[:, None])
