"""Clipping of each channel as conditions: runs `flat_top.py` with the model's probabilities."""

from typing import NamedTuple

import numpy as np

from monitor.clipping.flat_top import (
    NEVER,
    FlatTops,
    judge_flat_tops,
    new_flat_tops,
    reset_flat_tops,
)
from monitor.decision import rules_for
from monitor.model import RigModel
from monitor.signals import SENSOR_CLIPPED, Admitted, Condition, level
from rigwatch.wire.arrays import FloatArray


class SteadyClipping(NamedTuple):
    """The arguments of `judge_flat_tops` that stay, and how many channels may be judged."""

    judged: int
    chance: FloatArray
    limit: float
    state: FlatTops


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
        return self.conditions(score[admitted.padding :])

    def steady(self) -> SteadyClipping:
        """What a kernel needs to judge samples that follow the last ones."""
        return SteadyClipping(len(self._names), self._chance, self._limit, self._state)

    def conditions(self, kept: FloatArray) -> tuple[Condition, ...]:
        """The conditions for a score, shape (n, c), from `judge_flat_tops`."""
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
