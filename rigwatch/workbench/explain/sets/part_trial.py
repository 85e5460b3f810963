"""An effect of a set, fitted beside the others to a part of long training recordings."""

from dataclasses import dataclass

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.fit import Fitted, TrainingPart, continued_train_error, trained
from rigwatch.workbench.ranking import Order, Ranked, order_of, orders_at_port
from rigwatch.workbench.study import Study


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect fitted beside others to a part of the training.

    Attributes:
        error: on the part, with states of effects continued.
        starts: parameters found, by the effect's place before or after others at its port.
    """

    error: float
    starts: dict[Order, dict[str, float]]


def tried(study: Study, part: TrainingPart, base: Fitted, row: Ranked) -> Trial | None:
    """The effect of a row fitted to the part; None if it cannot be fitted.

    Args:
        study: with the effects of `base` in its model.
        part: of its training recordings.
        base: fit of these effects to the whole training.
        row: the effect.
    """
    base = part.of(base)
    begin, found = base.train.values() | row.begin(), dict[Order, Fitted]()
    for placement in orders_at_port(study, base, row):
        placements = (*base.placements, placement)
        try:
            found[order_of(placement)] = trained(study, part.data, placements, begin, base)
        except ModelError:
            continue
    errors = [error for each in found.values() if (error := _continued(each, part)) is not None]
    if not errors:
        return None
    return Trial(min(errors), {order: each.train.values() for order, each in found.items()})


def _continued(fitted: Fitted, part: TrainingPart) -> float | None:
    try:
        return continued_train_error(fitted, part.data)
    except ModelError:
        return None
