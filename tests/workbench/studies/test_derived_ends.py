"""Ends of a recording do not count where derived signals drive the model."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.physics.engine.fit import Thinning
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Columns
from rigwatch.workbench.data.derived_ends import without_ends
from rigwatch.workbench.data.recorded_columns import with_derived
from rigwatch.workbench.study.study_file import Derive, Derived, Thin

DT = 0.005
MEASURED = np.ones((2000, 1))


def study(derived: str = "velocity", thin: Thin | None = None) -> Any:
    """A damper's study; its model has a displacement and a velocity as inputs."""
    derive = Derive(low_pass=20.0, signals={derived: Derived(channel="x", order=1)})
    inputs = {name: SimpleNamespace(channel="") for name in ("displacement", "velocity")}
    file = SimpleNamespace(derive=derive, thin=thin, channels={})
    return SimpleNamespace(file=file, model=SimpleNamespace(inputs=inputs))


def test_two_periods_of_the_low_pass_do_not_count_at_each_end() -> None:
    found = without_ends(study(), MEASURED, DT)
    assert np.flatnonzero(np.isfinite(found[:, 0])).tolist() == list(range(20, 1980))


def test_a_short_recording_keeps_most_of_itself() -> None:
    assert np.isfinite(without_ends(study(), MEASURED[:50], DT)).sum() == 40


@pytest.mark.parametrize(
    "other", [study("acceleration"), study(thin=Thin(factor=2, edge=5))], ids=["unused", "thinned"]
)
def test_all_counts_where_no_derived_signal_drives_or_the_residual_has_ends(other: Any) -> None:
    assert np.isfinite(without_ends(other, MEASURED, DT)).all()


def test_a_recording_too_short_for_the_low_pass_is_refused() -> None:
    short = Columns(DT, {"x": np.linspace(0.0, 1.0, 12)})
    derive = Derive(low_pass=20.0, signals={"velocity": Derived(channel="x", order=1)})
    with pytest.raises(ModelError, match="found a recording of 12 samples, expected at least 16"):
        with_derived(short, derive)


@pytest.mark.parametrize("samples", [9, 27])
def test_a_recording_too_short_to_be_thinned_is_refused(samples: int) -> None:
    with pytest.raises(ModelError, match="expected at least 28 to thin"):
        Thinning(2, 0, (samples,)).apply(np.ones((1, samples, 1)))
    assert Thinning(2, 0, (28,)).apply(np.ones((1, 28, 1))).shape == (1, 14, 1)
