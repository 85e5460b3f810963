"""Jumps of a channel that shows a state: a state is an integral, so that no motion makes one.

The difference of neighbouring samples follows the rate of the state that the channel shows; if that
rate is a state as well, the difference of two differences follows its rate (T²·a of a position).
Healthy recordings say how large it becomes, noise and the converter's steps included.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from monitor.model import RangeSection
from monitor.signals import GOOD, NEW_BOOT, RESTART, Codes, Recording
from rigwatch.physics.engine.equations import Model, measured_states
from rigwatch.wire.arrays import FloatArray

JUMP = 2.0
"""Difference, over the largest of healthy recordings, that is a jump."""
DEEPEST = 2
"""Differences of a higher order tell noise."""


def bend_orders(model: Model) -> dict[str, int]:
    """Order of the difference that is bounded, of each channel that shows a state."""
    orders: dict[str, int] = {}
    for state in measured_states(model):
        orders[state.channel] = min(max(orders.get(state.channel, 0), state.order + 1), DEEPEST)
    return orders


def bends_of(healthy: Sequence[Recording], model: Model) -> dict[str, float]:
    """Largest difference that healthy recordings hold of each channel that shows a state."""
    return {
        name: max(float(np.abs(np.diff(one.channel(name), order)).max()) for one in healthy)
        for name, order in bend_orders(model).items()
    }


class ChannelJumps:
    """Finds jumps block by block.

    Args:
        seen: largest differences of healthy recordings; channels that it does not name cannot jump.
        model: as it was written.
        channels: what the columns of the samples are called.
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
        """Whether each channel has jumped to a sample, shape (n, channels)."""
        rows = np.concatenate([self._rows, signals[:, self._places]])
        run = self._runs(code)
        found = np.zeros((code.size, len(self._places)), np.bool_)
        for place, order in enumerate(self._orders):
            bend = np.abs(np.diff(rows[DEEPEST - order :, place], order))
            found[:, place] = (bend > self._limits[place]) & (run > order)
        self._rows = rows[-DEEPEST:]
        return found

    def _runs(self, code: Codes) -> Codes:
        """Good samples in a row up to each."""
        at = np.arange(code.size)
        began = np.where(code == GOOD, -1 - self._run, at)
        began = np.where((code == RESTART) | (code == NEW_BOOT), at - 1, began)
        run = np.asarray(at - np.maximum.accumulate(began), np.int64)
        self._run = int(run[-1])
        return run
