"""Edges that lost samples hide: a square wave's are found, and a sine has none."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.drives import BridgedEdges
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.signals import GOOD, NEW_BOOT
from rigwatch.wire.messages import RESAMPLED
from tests.monitor.observed_rig import RATE, SINE, block, model, run

N, LOST = 512, 3
SINE_WAVE = np.sin(2.0 * np.pi * 8.0 * np.arange(N) / RATE + 0.3)
SQUARE = np.sign(SINE_WAVE)
EDGE = int(np.flatnonzero(np.diff(SQUARE))[20])


def found(signal: np.ndarray, first: int, blocks: int) -> list[int]:
    """Samples at which an edge was hidden by those lost from `first` on."""
    bridged, code = np.zeros(N, np.bool_), np.full(N, GOOD)
    bridged[first : first + LOST], code[0] = True, NEW_BOOT
    edges = BridgedEdges()
    parts = [np.array_split(each, blocks) for each in (signal, bridged, code)]
    flags = [edges.update(*part) for part in zip(*parts, strict=True)]
    return np.flatnonzero(np.concatenate(flags)).tolist()


@pytest.mark.parametrize("blocks", [1, 7, N])
def test_a_hidden_edge_is_found_at_the_next_sample_of_its_own(blocks: int) -> None:
    assert found(SQUARE, EDGE - 1, blocks) == [EDGE - 1 + LOST]


@pytest.mark.parametrize("first", range(EDGE, EDGE + 16))
def test_lost_samples_of_a_smooth_input_hide_none(first: int) -> None:
    assert found(SINE_WAVE, first, 1) == []


def test_nothing_is_judged_for_a_second_after_a_hidden_edge() -> None:
    whole = block(run(SINE, 8.0))
    at = round(5.0 * RATE)  # the voltage crosses zero
    marks = np.zeros(len(whole), np.uint8)
    marks[at - 4 : at + 4] = RESAMPLED
    columns = tuple(replace(column, quality=marks) for column in whole.channels)

    watched = RigMonitor(model()).update(replace(whole, channels=columns))

    assert watched is not None
    armed = watched.estimates.column("armed").values
    assert armed[at - 64 : at].all()
    assert not armed[at + 4 : at + round(0.9 * RATE)].any()
