"""The observer scheme on a rig whose simulator nobody here wrote; skipped where it is not there."""

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from monitor.commissioning.equations import commission_equations
from monitor.model.model_file import RigModel
from monitor.signals.recordings import recording_of
from tests.monitor.observed_rig import FAULTS, RATE, raised, watched

FOLDER = Path(os.environ.get("RIGWATCH_DATA", "")) / "foreign_rig" / "watch"
NAMES = ("voltage", "position", "acceleration")
FRICTION_FROM = 10.0

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not FOLDER.is_dir(), reason="RIGWATCH_DATA holds no foreign_rig"),
]


def recorded(name: str) -> dict[str, np.ndarray]:
    """Channels of one recording."""
    table = np.loadtxt(FOLDER / f"{name}.csv", delimiter=",", skiprows=1)
    return {key: np.ascontiguousarray(table[:, 1 + k]) for k, key in enumerate(NAMES)}


@cache
def rig() -> RigModel:
    """Commissioned from healthy recordings alone, each of which begins at rest."""
    names = ("healthy_sine8", "healthy_sine4", "healthy_square8", "healthy_triangle8")
    healthy = [recording_of("healthy", name, RATE, recorded(name)) for name in names]
    return commission_equations([recording_of("chirp", "chirp", RATE, recorded("chirp")), *healthy])


@pytest.mark.parametrize("name", ["healthy_sine8_free", "start_stop_change"])
def test_healthy_raises_no_fault(name: str) -> None:
    assert not FAULTS & raised(watched(recorded(name), rig())).keys()


@pytest.mark.parametrize("name", ["friction_sine8_free", "friction_square8"])
def test_friction_is_named_and_given_in_newtons(name: str) -> None:
    found = watched(recorded(name), rig())

    times = raised(found)
    assert 0.0 <= times["departure"] - FRICTION_FROM < 0.06
    assert 0.0 <= times["dry_friction"] - FRICTION_FROM < 0.3
    force = found.estimates.column("friction_force").values[round(12.0 * RATE) :]
    # What was put on is 0.65 to 0.8 N.
    assert 0.5 < np.median(force) < 0.9


@pytest.mark.parametrize("name", ["fault_accel_gain", "fault_spring"])
def test_another_fault_is_not_called_friction(name: str) -> None:
    times = raised(watched(recorded(name), rig()))

    assert "other_fault" in times
    assert not times.keys() & {"dry_friction", "stiction"}
