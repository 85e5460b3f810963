"""The part of long training recordings on which what is only tried is fitted.

Most sets of effects that a search tries lead nowhere, and so do most delays of an input. Each is
fitted to a part first: stretches of adjacent windows, spread evenly over all recordings. Only the
best are fitted to the whole, which decides.

Each recording by itself is a part as well: it shows whether the recordings agree.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from rigwatch.physics.engine.equations import compose
from rigwatch.physics.engine.fit import Fit, Recording, apart, of_parts, windows
from rigwatch.wire.arrays import IntArray
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.training.continued_error import continued_train_error
from rigwatch.workbench.study import Study

ENOUGH = 1500
"""Samples that tell what is promising from what is not."""
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


def part_of(study: Study, data: Data) -> TrainingPart | None:
    """The part for a study; None if its recordings are short or cannot be divided.

    Args:
        study: what is fitted to whole recordings, as a constant of each, is the same in all studies
            of the same data.
        data: its recordings.
    """
    if data not in _PARTS:
        _PARTS[data] = _part(study, data)
    return _PARTS[data]


def _part(study: Study, data: Data) -> TrainingPart | None:
    whole = data.train
    if not _is_divisible(study, data):
        return None
    cut = windows(compose(study.model), len(whole), data.horizon)
    starts, length = cut.starts, cut.length
    factor = len(starts) // max(math.ceil(ENOUGH / length), FEWEST)
    if factor < 2:
        return None
    stretches = list(_stretches(_counts(whole, length, len(starts)), factor))
    chosen = np.concatenate([np.arange(first, first + count) for first, count in stretches])
    rows = (starts[chosen][:, None] + np.arange(length)).ravel()
    parts = tuple(count * length for _, count in stretches)
    begins = starts[[first for first, _ in stretches]]
    own, begun = whole.spacing[begins], whole.time[begins]
    dt, spacings = of_parts(own.tolist(), parts)
    train = replace(
        whole, dt=dt, inputs=whole.inputs[rows], outputs=whole.outputs[rows], parts=parts,
        breaks=(), spacings=spacings, begun=tuple(begun.tolist()),
    )  # fmt: skip
    return TrainingPart(replace(data, train=train), chosen)


def each_recording(study: Study, data: Data) -> list[TrainingPart]:
    """Each training recording as a part by itself; empty if they cannot be taken apart.

    Args:
        study, data: as in `part_of`.
    """
    if not _is_divisible(study, data):
        return []
    recordings = apart(data.train)
    length = windows(compose(study.model), len(data.train), data.horizon).length
    if any(len(alone) % length for alone in recordings):
        return []
    return [
        TrainingPart(replace(data, train=alone), np.arange(own.start // length, own.stop // length))
        for own, alone in zip(data.train.slices, recordings, strict=True)
    ]


def _is_divisible(study: Study, data: Data) -> bool:
    """Whether windows can be taken out: a model without states has none, some must stay whole."""
    whole = data.along_motion or data.train.thinning or study.moving()
    return bool(study.model.states) and not whole


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
