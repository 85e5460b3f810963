"""Debounces per-sample flags: persistence for the rising edge, hysteresis for the falling edge.

The level rises at the `persistence`-th consecutive sample with the condition and falls at the
`clear_after`-th consecutive sample without it, independently of how samples are divided into
blocks. A run of samples with the condition ends at a gap. One of samples without it continues where
the gap was bridged: else no alarm would clear on a line that loses a sample now and then.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Edge:
    """A change of the level.

    Attributes:
        index: index in the block of the sample at which the level changes.
        rising: whether the level is on from here.
        onset_seq: for a rising edge, number of the first sample of the run.
    """

    index: int
    rising: bool
    onset_seq: int


def is_zero(flags: NDArray[np.uint8]) -> bool:
    """Whether no flag is set; four times as fast as `any` on the few samples of a block."""
    return flags.tobytes() == bytes(flags.size)


class Debouncer:
    """One condition's level, carried from block to block.

    Args:
        persistence: consecutive samples with the condition for the level to rise.
        clear_after: consecutive samples without it for the level to fall.
    """

    def __init__(self, persistence: int, clear_after: int) -> None:
        self.persistence, self.clear_after = persistence, clear_after
        self.level = False
        self._run = 0
        self._onset_seq = -1

    @property
    def is_idle(self) -> bool:
        """Whether samples without the condition change nothing."""
        return not self.level and self._run == 0

    def interrupt(self, *, bridged: bool = False) -> None:
        """Discard a run in progress: the next sample does not follow the last one.

        Args:
            bridged: so few samples are missing that estimates continue; a falling run does, too.
        """
        if not (bridged and self.level):
            self._run = 0

    def update(self, active: NDArray[np.uint8], first_seq: int) -> list[Edge]:
        """Edges within a block whose first sample is `first_seq`; `active` has shape (n,)."""
        n = len(active)
        if self.is_idle and is_zero(active):
            return []
        edges: list[Edge] = []
        cuts = np.flatnonzero(np.diff(active)) + 1
        start = 0
        for stop in (*cuts.tolist(), n):
            self._take_run(bool(active[start]), start, stop, first_seq, edges)
            start = stop
        return edges

    def _take_run(
        self, active: bool, start: int, stop: int, first_seq: int, edges: list[Edge]
    ) -> None:
        """Account for the samples from `start` to `stop`, which have equal flags."""
        if active == self.level:
            self._run = 0
            return
        if self._run == 0:
            self._onset_seq = first_seq + start
        needed = (self.persistence if active else self.clear_after) - self._run
        if needed > stop - start:
            self._run += stop - start
            return
        self.level, self._run = active, 0
        edges.append(Edge(start + needed - 1, active, self._onset_seq))
