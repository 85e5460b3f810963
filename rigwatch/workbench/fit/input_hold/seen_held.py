"""Inputs that are seen to be held, as their steps start and end at rest.

They are not taken as lines, however far off the model is: a line through a step begins half a
sample before the step.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data
from rigwatch.workbench.study import Study

STEP = 0.05
"""Least change of an input that counts as a step, over its range."""
STEPPED = 0.9
"""Share of the squared changes of an input in steps from rest to rest, from which it is held."""


def seen_held(study: Study, data: Data) -> bool:
    """Whether all inputs without a hold that change are seen to be held."""
    unheld, train = set(study.model.unheld()), data.train
    own = [at for at, name in enumerate(study.model.inputs) if name in unheld]
    changing = [at for at in own if np.ptp(train.inputs[:, at]) > 0]
    return bool(changing) and all(
        any(stepped(train.inputs[part, at]) for part in train.slices) for at in changing
    )


def stepped(signal: FloatArray) -> bool:
    """Whether a signal changes in steps from rest to rest, so that it is held between samples.

    Args:
        signal: of one recording, shape (samples,).
    """
    change = np.diff(signal)
    moves = np.concatenate([[False], change != 0.0, [False]])
    alone = moves[1:-1] & ~moves[:-2] & ~moves[2:] & (np.abs(change) > STEP * np.ptp(signal))
    total = float(np.sum(np.square(change)))
    return total > 0.0 and float(np.sum(np.square(change[alone]))) >= STEPPED * total
