"""Gaps in the residual stage: what the filters keep of samples that are missing."""

import msgspec
import numpy as np
import pytest

from monitor.model import RigModel, TransferPlant
from monitor.signals import (
    GOOD,
    HELD,
    NEW_BOOT,
    TransferResidual,
)
from tests.monitor.monitor_rig import SINE, model, run

FIRST, LENGTH = 700, 2


def late_model(samples: int) -> RigModel:
    """The model with measured signals that come late."""
    plant = model().plant
    assert isinstance(plant, TransferPlant)
    shift = plant.shift + samples + int(np.argmax(np.array(plant.b) != 0.0))
    return msgspec.structs.replace(model(), plant=msgspec.structs.replace(plant, shift=shift))


def signals() -> np.ndarray:
    channels = run(SINE, 4.0, seed=34)
    return np.column_stack([channels[name] for name in ("voltage", "position", "acceleration")])


def codes(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Without and with a gap."""
    whole = np.full(n, GOOD, np.int64)
    whole[0] = NEW_BOOT
    lost = whole.copy()
    lost[FIRST : FIRST + LENGTH] = HELD
    return whole, lost


@pytest.mark.parametrize("late", [0, 1, 3])
def test_a_gap_whose_readings_are_usual_leaves_no_trace(late: int) -> None:
    given = signals()
    whole, lost = codes(len(given))
    want = TransferResidual(late_model(late)).update(given, whole)
    broken, end = given.copy(), FIRST + LENGTH
    broken[FIRST:end] = broken[FIRST - 1]
    stage = TransferResidual(late_model(late))
    stage.update(broken[:end], lost[:end])
    found = stage.update(broken[end:], lost[end:], given[FIRST - 1 : end + 1])
    assert found == pytest.approx(want[end:], rel=1e-9, abs=1e-12)


def test_a_gap_in_a_smooth_motion_is_interpolated() -> None:
    given = signals()
    whole, lost = codes(len(given))
    want = TransferResidual(model()).update(given, whole)[:, 3]
    broken, end = given.copy(), FIRST + LENGTH
    broken[FIRST:end] = broken[FIRST - 1]
    found = TransferResidual(model()).update(broken, lost)[:, 3]
    # Held, the readings would be wrong by a tenth of the amplitude and more.
    size = 0.05 * np.abs(given[:, 0]).max() * 0.5
    assert np.abs(found - want)[end:].max() < size


def test_a_missing_sample_counts_as_missing_where_it_leaves_the_delay_line() -> None:
    given = signals()
    _, lost = codes(len(given))
    TransferResidual(late_model(5)).update(given, lost)
    assert np.flatnonzero(lost == HELD).tolist() == [700, 701, 705, 706]
