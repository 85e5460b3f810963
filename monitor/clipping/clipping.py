"""Clipping of each channel as conditions: runs `flat_top.py` with the model's probabilities."""

import numpy as np

from monitor.clipping.flat_top import NEVER, judge_flat_tops, new_flat_tops, reset_flat_tops
from monitor.decision import rules_for
from monitor.model import RigModel
from monitor.signals import SENSOR_CLIPPED, Admitted, Condition, level


class Clipping:
    """Accumulates the evidence of every channel from block to block.

    Args:
        model: gives the probability of a repeated reading; channels without one are not judged.
    """

    def __init__(self, model: RigModel) -> None:
        known = model.noise.repeat or (NEVER,) * len(model.channels)
        self._chance = np.array(known)
        self._limit = 0.5 * rules_for(model).factor ** 2
        self._names = [
            (place, f"{SENSOR_CLIPPED}.{channel}")
            for place, channel in enumerate(model.channels)
            if known[place] < NEVER
        ]
        self._state = new_flat_tops(len(model.channels))

    def update(self, admitted: Admitted) -> tuple[Condition, ...]:
        """Conditions of the block's samples, without the padding for missing ones."""
        if not self._names:
            return ()
        if admitted.missing < 0:
            reset_flat_tops(self._state)
        elif admitted.missing:
            self._state.last[:] = np.nan
        score = np.zeros(admitted.signals.shape)
        judge_flat_tops(
            admitted.signals, admitted.good, self._chance, self._limit, self._state, score
        )
        kept = score[admitted.padding :]
        none, limit = level(len(kept), -np.inf), level(len(kept), float(self._limit))
        return tuple(
            Condition(
                name,
                (kept[:, place] > self._limit).astype(np.uint8),
                kept[:, place].copy(),
                none,
                limit,
            )
            for place, name in self._names
        )
