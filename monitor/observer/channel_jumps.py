"""Detects jumps of channels that measure a state, which no motion can cause.

A state is an integral. The difference of neighbouring samples is bounded by the rate of the state;
if that rate is also a state, the second difference is bounded by its rate (T²·a of a position).
Healthy recordings give the largest values, including noise and quantisation.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from monitor.model import RangeSection
from monitor.signals import GOOD, NEW_BOOT, RESTART, Codes, Recording
from rigwatch.physics.engine.equations import Model, measured_states
from rigwatch.wire.arrays import FloatArray

JUMP = 2.0
"""Ratio of a difference to the largest of healthy recordings above which it is a jump."""
DEEPEST = 2
"""Highest order of difference used; higher orders are dominated by noise."""


def bend_orders(model: Model) -> dict[str, int]:
    """Order of the bounded difference, for each channel that measures a state."""
    orders: dict[str, int] = {}
    for state in measured_states(model):
        orders[state.channel] = min(max(orders.get(state.channel, 0), state.order + 1), DEEPEST)
    return orders


def bends_of(healthy: Sequence[Recording], model: Model) -> dict[str, float]:
    """Largest difference in healthy recordings, for each channel that measures a state."""
    return {
        name: max(float(np.abs(np.diff(one.channel(name), order)).max()) for one in healthy)
        for name, order in bend_orders(model).items()
    }


class ChannelJumps:
    """Finds jumps block by block.

    Args:
        seen: largest differences in healthy recordings, by channel; others are not checked.
        model: the unmodified model.
        channels: names of the columns of the samples.
    """

    def __init__(self, seen: RangeSection, model: Model, channels: Sequence[str]) -> None:
        orders = bend_orders(model)
        self.channels = seen.channels
        self._orders = [orders[name] for name in seen.channels]
        self._places = [channels.index(name) for name in seen.channels]
        self._limits = JUMP * np.array(seen.bends)
        self._rows = np.zeros((DEEPEST, len(self._places)))
        self._run = 0

    def update(self, signals: FloatArray, code: Codes) -> NDArray[np.bool_]:
        """Whether each channel jumps at each sample, shape (n, channels)."""
        rows = np.concatenate([self._rows, signals[:, self._places]])
        run = self._runs(code)
        found = np.zeros((code.size, len(self._places)), np.bool_)
        for place, order in enumerate(self._orders):
            bend = np.abs(np.diff(rows[DEEPEST - order :, place], order))
            found[:, place] = (bend > self._limits[place]) & (run > order)
        self._rows = rows[-DEEPEST:]
        return found

    def _runs(self, code: Codes) -> Codes:
        """Number of consecutive good samples up to each sample."""
        at = np.arange(code.size)
        began = np.where(code == GOOD, -1 - self._run, at)
        began = np.where((code == RESTART) | (code == NEW_BOOT), at - 1, began)
        run = np.asarray(at - np.maximum.accumulate(began), np.int64)
        self._run = int(run[-1])
        return run
