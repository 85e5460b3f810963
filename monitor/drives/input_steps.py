"""An input between samples, as far as it is known: means where its steps slide or jitter.

That steps jitter, or that edges lie between samples, is an assumption: a generator that holds each
voltage for several samples repeats readings too. Both are given beside the readings, and the motion
tells what is true (see `edge_choice`).
"""

from typing import NamedTuple

import numpy as np

from monitor.drives.held_readings import HeldReadings
from monitor.drives.jittered_edges import JitteredEdges
from monitor.drives.jittered_steps import JitteredSteps
from monitor.drives.sliding_edges import SlidingEdges
from monitor.drives.sliding_steps import SlidingSteps
from monitor.signals import Codes
from rigwatch.wire.arrays import BoolArray, FloatArray

JITTER, EDGES = 0.1, 0.5
"""Uncertainty of the instants of steps that jitter [samples]: of those that are told apart, that of
each interval's share; of edges and of held voltages, that of one read early or late.
"""


class Steps(NamedTuple):
    """An input at the samples `half_width` before those given, each of shape (n,).

    Attributes:
        mean: its mean until the next sample; 0 with too few samples.
        known: False while its steps slide and their clock is not yet known.
        unsure: uncertainty of the instants of its steps [samples].
        jitters: whether that is of edges that jitter at the time, so that the motion shows how far
            they are from where they are read, see `read_instants`.
        moved: what the mean gains if edges lie between samples, see `sliding_edges`, or if steps
            jitter, see `jittered_steps`.
        moves: whether that is known.
    """

    mean: FloatArray
    known: BoolArray
    unsure: FloatArray
    jitters: BoolArray
    moved: FloatArray
    moves: BoolArray


class InputSteps:
    """Follows one input, block by block.

    Args:
        half_width: lag of the results [samples].
        jitters: whether steps that seem to jitter are known to do so.
    """

    def __init__(self, half_width: int, jitters: bool = False) -> None:
        self._jitters = jitters
        self._sliding = SlidingSteps(half_width)
        self._jittered = JitteredSteps(half_width)
        self._edges = JitteredEdges()
        self._held = HeldReadings()
        self._regular = SlidingEdges(half_width)

    def update(self, signal: FloatArray, code: Codes) -> Steps:
        """The next samples of the input, shape (n,), with states of the admission."""
        slides = self._sliding.update(signal, code)
        found = self._jittered.update(signal, code)
        edges, held = self._edges.update(signal, code), self._held.update(signal, code)
        regular = self._regular.update(signal, code)
        # Steps that slide and jitter do the latter only where they meet the samples.
        jitters = np.where(slides.followed, found.shows, found.jitters) & ~regular.shows
        mean = np.where(regular.shows, regular.held, slides.mean)
        known = slides.known | jitters | regular.shows
        unsure = np.where(edges.unsure | held, EDGES, np.where(jitters, JITTER, 0.0))
        read = edges.jitters & ~held & ~jitters & ~regular.shows
        unsure = np.where(regular.shows, regular.unsure, unsure)
        if self._jitters:
            mean = np.where(jitters, found.value, mean)
            return Steps(mean, known, unsure, read, regular.gained, regular.shows)
        moved = np.where(jitters, found.value - mean, regular.gained)
        return Steps(mean, known, unsure, read, moved, regular.shows | jitters)
