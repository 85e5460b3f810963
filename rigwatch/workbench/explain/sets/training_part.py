"""The part of long training recordings on which sets of effects are tried.

Most sets that a search tries lead nowhere. Each is fitted to a part first: stretches of adjacent
windows, spread evenly over all recordings. Only the best are fitted to the whole.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from rigwatch.physics.engine.fit import Fit, Recording, of_parts, windows
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted, continued_train_error, trained
from rigwatch.workbench.ranking import Order, Ranked, order_of, orders_at_port
from rigwatch.workbench.study import Study

ENOUGH = 1500
"""Samples that tell promising sets from others."""
FEWEST = 16
"""Fewest windows of a part."""
STRETCH = 8
"""Most adjacent windows, so that states of effects which run through them are of use."""
_PARTS: WeakKeyDictionary[Data, "TrainingPart | None"] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class TrainingPart:
    """A part of the training recordings.

    Attributes:
        data: the study's data with the part as training.
        windows: those of the whole that belong to it.
    """

    data: Data
    windows: IntArray

    def of(self, fitted: Fitted) -> Fitted:
        """A fit to the whole training, as seen on the part."""
        return replace(fitted, train=self._of_fit(fitted.train))

    def _of_fit(self, own: Fit) -> Fit:
        """A fit, and the one before it in which hidden states begin anew, on the part."""
        rows, anew = self.windows, own.begun_anew
        return replace(
            own, initial=own.initial[rows], residuals=own.residuals[rows],
            error=own.error[rows], jacobian=own.jacobian[rows],
            begun_anew=self._of_fit(anew) if anew else None,
        )  # fmt: skip

    def error(self, fitted: Fitted) -> float:
        """Error on the part of a fit to the whole, with states of effects continued."""
        return continued_train_error(self.of(fitted), self.data)


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect fitted beside others to a part of the training.

    Attributes:
        error: on the part, with states of effects continued.
        starts: parameters found, by the effect's place before or after others at its port.
    """

    error: float
    starts: dict[Order, dict[str, float]]


def part_of(bench: Bench) -> TrainingPart | None:
    """The part for a study; None if its recordings are short or cannot be divided."""
    if bench.data not in _PARTS:
        _PARTS[bench.data] = _part(bench)
    return _PARTS[bench.data]


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
        try:
            found[order_of(placement)] = trained(study, part.data, placement, begin, base)
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


def _part(bench: Bench) -> TrainingPart | None:
    data, whole = bench.data, bench.data.train
    system = bench.base.compiled.system
    # Without states of its own a model has no windows, and some recordings must stay whole.
    if not system.model.states or data.along_motion or whole.thinning or bench.study.moving():
        return None
    cut = windows(system, len(whole), bench.base.horizon)
    factor = len(cut.starts) // max(math.ceil(ENOUGH / cut.length), FEWEST)
    if factor < 2:
        return None
    stretches = list(_stretches(_counts(whole, cut.length, len(cut.starts)), factor))
    chosen = np.concatenate([np.arange(first, first + count) for first, count in stretches])
    rows = (cut.starts[chosen][:, None] + np.arange(cut.length)).ravel()
    parts = tuple(count * cut.length for _, count in stretches)
    own = whole.spacing[cut.starts[[first for first, _ in stretches]]]
    dt, spacings = of_parts(own.tolist(), parts)
    train = replace(
        whole, dt=dt, inputs=whole.inputs[rows], outputs=whole.outputs[rows], parts=parts,
        breaks=(), spacings=spacings,
    )  # fmt: skip
    return TrainingPart(replace(data, train=train), chosen)


def _counts(recording: Recording, length: int, every: int) -> list[int]:
    """Number of windows of each recording."""
    ends = np.cumsum(recording.parts or (len(recording),)) // length
    return [int(count) for count in np.diff(np.minimum(ends, every), prepend=0)]


def _stretches(counts: list[int], factor: int) -> Iterator[tuple[int, int]]:
    """First window and number of windows of each stretch.

    Every recording gives one at least, each at another place: tests often begin and end alike.
    """
    first, turn = 0, 0
    for count in counts:
        for begin in range(0, count, factor * STRETCH):
            size = min(factor * STRETCH, count - begin)
            yield first + begin + turn % factor * size // factor, math.ceil(size / factor)
            turn += 1
        first += count
