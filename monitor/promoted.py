"""Friction that the model has learnt, as part of the modelled acceleration.

    am ← am + θ1·g1 + θ2·g2 - d1·|g1| - d2·|g2|

with g1, g2 the regressors of the residual stage, so that friction goes through the same filter as
its estimates do; d, the halves of what differs by direction, only for an inertia, whose g have the
sign of -v. What is estimated from then on is friction beyond that.
"""

from dataclasses import dataclass

from monitor.model_file import InertiaPlant, PromotedSection, RigModel
from monitor.residual import G1, G2, MODELLED
from rigwatch.physics.transfer_function import FloatArray
from rigwatch.wire.errors import ModelError


def add_promoted(data: FloatArray, promoted: PromotedSection | None) -> None:
    """Add it to the residual stage's columns, shape (n, 7), sample by sample, in place."""
    if promoted is None:
        return
    g1, g2 = data[:, G1], data[:, G2]
    data[:, MODELLED] += promoted.coulomb * g1
    data[:, MODELLED] += promoted.viscous * g2
    if promoted.coulomb_by_direction or promoted.viscous_by_direction:
        data[:, MODELLED] -= promoted.coulomb_by_direction * abs(g1)
        data[:, MODELLED] -= promoted.viscous_by_direction * abs(g2)


@dataclass(frozen=True)
class Frozen:
    """What of a model must stay as it is while the monitor runs on."""

    sample_rate: float
    channels: tuple[str, ...]
    plant: object
    filters: object


def check_can_follow(old: RigModel, new: RigModel) -> None:
    """Refuse a model that the running filters do not suit.

    Raises:
        ModelError: more differs than mass, offset, friction, noise and limits.
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
    return Frozen(model.sample_rate, model.channels, plant, (filters, model.decision.longest_hold))
