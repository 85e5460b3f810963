"""Equations along the motion: pairs of lost samples raise nothing, and friction is named."""

import numpy as np
import pytest

from monitor.observer.lagged_motion import FixedLag, MotionColumn
from monitor.pipeline import RigMonitor
from monitor.signals import GOOD, HELD, NEW_BOOT
from rigwatch.wire.messages.message_types import Alarm
from sim_plant.excitation import Shape
from sim_plant.scenario import Event
from tests.monitor.observed_rig import FAULTS, FREE, RATE, SLOWER, block, coulomb, model, run

ONSET = 6.0


def first_alarms(drive: Shape, events: tuple[Event, ...]) -> dict[str, float]:
    """Time of each fault's first alarm on a line that loses two samples every 64 [s]."""
    channels = run(drive, 9.0, events, seed=31)
    monitor, first = RigMonitor(model()), 0
    times: dict[str, float] = {}
    for last in [*range(7, len(channels["voltage"]) - 8, 64), len(channels["voltage"])]:
        found = monitor.update(block(channels, first, last))
        assert found is not None
        for said in found.announcements:
            if isinstance(said, Alarm) and said.name in FAULTS:
                times.setdefault(said.name, said.seq / RATE)
        first = last + 2
    return times


@pytest.mark.parametrize("drive", [FREE, SLOWER], ids=["free", "slower"])
def test_only_friction_is_named_on_a_line_that_loses_samples(drive: Shape) -> None:
    found = first_alarms(drive, coulomb(ONSET))
    assert found.keys() == {"departure", "dry_friction"}
    assert ONSET < found["departure"] < ONSET + 0.1
    assert ONSET < found["dry_friction"] < ONSET + 1.0


@pytest.mark.parametrize("size", [1, 5, 100])
def test_a_straight_motion_is_straight_across_a_gap(size: int) -> None:
    n, half_width = 100, 4
    straight = 3.0 + 0.5 * np.arange(n)
    code = np.full(n, GOOD, np.int64)
    code[0], code[40:42] = NEW_BOOT, HELD
    given = straight.copy()
    given[40:42] = given[39]
    lag = FixedLag([MotionColumn(0, -1), MotionColumn(0, 1)], half_width, RATE)
    parts = [
        lag.update(given[k : k + size, None], code[k : k + size])[0] for k in range(0, n, size)
    ]
    found = np.concatenate(parts)[42:]
    assert found[:, 0] == pytest.approx(straight[42 - half_width : n - half_width])
    assert found[:, 1] == pytest.approx(0.5 * RATE)
