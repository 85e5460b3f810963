"""How much more a healthy rig leaves at a motion that was not recorded.

Remainder, healthy variance and limits are fitted to the recorded motions, which they suit better
than any other motion of the same size. Each healthy recording is therefore judged once by a
remainder and limits of all others, where its motion is inside their range.
"""

from collections.abc import Callable, Sequence

import numpy as np
from msgspec.structs import replace
from scipy.signal import lfilter

from monitor.commissioning.equations.healthy_limits import mean_over, variance
from monitor.model import EquationsPlant, RangeSection, RemainderSection, RigModel
from monitor.observer import (
    MEDIUM,
    PREDICTED,
    E,
    Layout,
    Observed,
    RangeSeen,
    equations_of,
    fit_remainder,
    high_pass,
    layout_of,
    levels,
    terms,
)
from rigwatch.wire.arrays import FloatArray

SKIPPED = 2.0
"""Start of each recording that is skipped, as filters and spectra settle [s]."""
MOST = 3.0
"""Largest ratio that is believed: a larger one says that the others hardly describe a rig."""


def largest_unseen(
    model: RigModel,
    parts: Sequence[Observed],
    roles: Sequence[str],
    range_of_others: Callable[[int], RangeSection],
) -> float:
    """Largest `unseen_ratio` of all healthy recordings; 0 of a single recording.

    Args:
        model: commissioned from all recordings.
        parts: the recordings.
        roles: of each.
        range_of_others: the range of motion of all but one.
    """
    places = [place for place, role in enumerate(roles) if role == "healthy"]
    if len(parts) == 1:
        return 0.0
    return max(unseen_ratio(model, parts, place, range_of_others(place)) for place in places)


def unseen_ratio(
    model: RigModel, parts: Sequence[Observed], place: int, others: RangeSection
) -> float:
    """Largest residual of a recording relative to the largest of all others; at most `MOST`.

    Both are relative to the healthy variance that the others show. Their ratio is one of
    amplitudes, 0 if the recording's motion is outside their range.

    Args:
        model: commissioned from all recordings.
        parts: the recordings, at least two.
        place: of the recording among them.
        others: the range of motion of all others.
    """
    layout, skip = _layout(model), round(SKIPPED * model.sample_rate)
    seen = RangeSeen(replace(model, motion_range=others), layout.speed)
    inside = seen.distance(parts[place], seen.motion(parts[place])) <= 1.0
    energies = _relative_energies(model, parts, place, skip)
    judged = energies[place][inside[skip + MEDIUM - 1 :]]
    largest = max(float(each.max()) for k, each in enumerate(energies) if k != place)
    return min(float(np.sqrt(judged.max(initial=0.0) / largest)), MOST)


def _layout(model: RigModel) -> Layout:
    assert isinstance(model.plant, EquationsPlant)
    return layout_of(equations_of(model.plant), model.plant.port)


def _relative_energies(
    model: RigModel, parts: Sequence[Observed], place: int, skip: int
) -> list[FloatArray]:
    """Energies over medium windows, with remainder and variance of all recordings but one."""
    assert isinstance(model.plant, EquationsPlant)
    assert model.remainder is not None
    layout, filters = _layout(model), high_pass(model.plant.corner, model.sample_rate)
    signals = [o.arguments for o in parts]
    bare = [
        o.judged[:, E] + _described(model.remainder, z, filters)
        for o, z in zip(parts, signals, strict=True)
    ]
    others = [k for k in range(len(parts)) if k != place]
    known = fit_remainder([(signals[k], bare[k]) for k in others], filters, skip, layout.sensed)
    errors, grown = [], []
    for o, z, e in zip(parts, signals, bare, strict=True):
        left = (e - _described(known, z, filters))[skip:]
        motion = levels(o.rows[:, list(layout.motions)], o.judged[:, PREDICTED], known)[skip:]
        errors.append(mean_over(left**2, MEDIUM))
        grown.append(np.column_stack([mean_over(level, MEDIUM) for level in motion.T]))
    noise, growth = variance([errors[k] for k in others], [grown[k] for k in others])
    return [e / (noise**2 + level @ growth) for e, level in zip(errors, grown, strict=True)]


def _described(
    known: RemainderSection, signals: FloatArray, filters: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """What a remainder describes of the residual, shape (n,)."""
    columns = terms(signals, np.array(known.centre), np.array(known.scale))
    return np.asarray(lfilter(*filters, columns @ np.array(known.weights)))
