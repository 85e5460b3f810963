"""Promoted friction: friction from a study as part of the modelled acceleration.

    am ← am + θ1·g1 + θ2·g2 - d1·|g1| - d2·|g2|

with g1, g2 the regressors of the residual stage, so friction passes through the same filter as its
estimates; d, half the differences between the directions, only for an inertia, whose g have the
sign of -v.

With a noisy velocity the sign changes a sample early or late, and promoted friction jumps with it,
which adds noise. With `smooth`, g1 is Ge[tanh(v/smooth)] here. Subsequent estimates are of friction
in addition to this.
"""

import math
from dataclasses import dataclass

import numpy as np

from monitor.model import InertiaPlant, PromotedSection, RigModel
from monitor.signals import DEAD, G1, G2, MODELLED, NEW_BOOT, RESTART, VELOCITY, Codes, fill
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel


class PromotedFriction:
    """The running stage, between residual and watch.

    Args:
        model: the current model; without promoted friction nothing is added.

    Attributes:
        adds: whether anything is added.
    """

    def __init__(self, model: RigModel) -> None:
        self._promoted = known = model.promoted or PromotedSection()
        directed = known.coulomb_by_direction or known.viscous_by_direction
        self.adds = bool(known.coulomb or known.viscous or directed)
        self._b, self._a = model.friction.function().padded()
        self._state = np.zeros(max(self._b.size - 1, 1))

    def add(self, data: FloatArray, code: Codes) -> None:
        """Add promoted friction to the residual stage's columns, shape (n, 7), in place."""
        known = self._promoted
        if not self.adds:
            return
        if known.smooth > 0.0:
            g1 = np.zeros(len(data))
            _smoothed(data, code, known.smooth, self._b, self._a, self._state, g1)
        else:
            g1 = data[:, G1]
        g2 = data[:, G2]
        data[:, MODELLED] += known.coulomb * g1
        data[:, MODELLED] += known.viscous * g2
        if known.coulomb_by_direction or known.viscous_by_direction:
            data[:, MODELLED] -= known.coulomb_by_direction * abs(g1)
            data[:, MODELLED] -= known.viscous_by_direction * abs(g2)


@kernel()
def _smoothed(  # noqa: PLR0917
    data: FloatArray,
    code: Codes,
    smooth: float,
    b: FloatArray,
    a: FloatArray,
    state: FloatArray,
    out: FloatArray,
) -> None:
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(state, 0.0)
        if code[k] != DEAD:
            out[k] = filter_sample(b, a, state, math.tanh(data[k, VELOCITY] / smooth))


@dataclass(frozen=True)
class Frozen:
    """The parts of a model that must not change while the monitor runs."""

    sample_rate: float
    channels: tuple[str, ...]
    plant: object
    filters: object


def check_can_follow(old: RigModel, new: RigModel) -> None:
    """Check that a new model is compatible with the running filters.

    Raises:
        ModelError: it differs in more than mass, offset, friction, noise and limits.
    """
    if _frozen(old) != _frozen(new):
        raise ModelError(
            "the new model: found other channels, rate or filters than the running one's, expected"
            " the same: stop the monitor to change them"
        )


def _frozen(model: RigModel) -> Frozen:
    inertia = isinstance(model.plant, InertiaPlant)
    plant = model.plant.half_width if isinstance(model.plant, InertiaPlant) else model.plant
    filters = None if inertia else (model.velocity, model.friction)
    fixed = (filters, model.decision.longest_hold, _signals(model))
    return Frozen(model.sample_rate, model.channels, plant, fixed)


def _signals(model: RigModel) -> object:
    """The signals on which limits of the observer scheme are; None in the friction scheme."""
    if model.motion_range is None or model.remainder is None or model.healthy is None:
        return None
    return model.motion_range.names, len(model.remainder.centre), len(model.healthy.growth)
