"""The time series of an examination over the whole record: signals and test statistic."""

from collections.abc import Mapping

import numpy as np

from rigwatch.structures.damage.examination import Examination
from rigwatch.wire.arrays import FloatArray

SIGMAS = 3.0
"""Standard deviations of noise beyond which a single residual is significant."""
UNDAMAGED, FOUND = "undamaged model", "with the damage found"


def statistic(found: Examination) -> FloatArray:
    """Test statistic over its threshold at every sample, NaN outside the monitored span."""
    values = np.full(len(found.reference.model), np.nan)
    for first, part in reversed(pieces(found)):  # an alarm's own sample shows what raised it
        values[first : first + len(part)] = part
    return values


def pieces(found: Examination) -> list[tuple[int, FloatArray]]:
    """First sample and statistic over threshold of each watch, up to the alarm that ended it."""
    dt, end = found.reference.model.dt, len(found.reference.model)
    stops = [round(damage.alarm / dt) for damage in found.damages]
    made = []
    for index, watch in enumerate(found.watches):
        last = stops[index] + 1 if index < len(stops) else end
        begin = max(watch.first, stops[index - 1] if index else 0)
        part = watch.statistic[begin - watch.first : last - watch.first]
        made.append((begin, part / watch.threshold))
    return made


def modelled(found: Examination) -> Mapping[str, FloatArray]:
    """Signals of the undamaged model and, if there is damage, of the damaged one.

    Each of shape (samples, m), NaN without a measurement.
    """
    observed = found.reference.model.observed
    base = observed + found.watches[0].residual
    if len(found.watches) < 2:
        return {UNDAMAGED: base}
    changed = base.copy()
    for watch in found.watches[1:]:
        changed[watch.first :] = observed[watch.first :] + watch.residual
    return {UNDAMAGED: base, FOUND: changed}


def loudness(found: Examination) -> FloatArray:
    """Largest residual of each signal over its noise, shape (m,)."""
    scaled = np.abs(np.nan_to_num(found.watches[0].residual / found.reference.sigma))
    return np.asarray(scaled.max(axis=0))


def loudest(found: Examination) -> int:
    """The signal with the largest residual relative to its noise."""
    return int(np.argmax(loudness(found)))


def band(found: Examination) -> tuple[str, FloatArray]:
    """Name and size of a significant residual of each signal, shape (m,)."""
    sigma = found.reference.sigma
    if found.settings.limit is not None:
        return "limit", np.full(len(sigma), found.settings.limit)
    return f"{SIGMAS:g} sigma", SIGMAS * sigma
