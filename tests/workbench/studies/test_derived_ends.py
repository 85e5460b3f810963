"""Ends of a recording do not count where derived signals drive the model; nor does noise that the
low-pass has taken from a derived output.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.physics.engine.fit import Thinning
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.data import Columns
from rigwatch.workbench.data.derived_ends import without_ends
from rigwatch.workbench.data.recorded_columns import with_derived
from rigwatch.workbench.study.study_file import Derive, Derived, Span, StudyFile, Thin
from tests.workbench.machine import studied

DT = 0.005
MEASURED = np.ones((2000, 1))


def study(derived: str = "velocity", thin: Thin | None = None) -> Any:
    """A damper's study; its model has a displacement and a velocity as inputs."""
    derive = Derive(low_pass=20.0, signals={derived: Derived(channel="x", order=1)})
    spans = (Span(session="log"),)
    file = StudyFile(model="damper", train=spans, held_out=spans, derive=derive, thin=thin)
    inputs = {name: SimpleNamespace(channel="") for name in ("displacement", "velocity")}
    outputs = {"force": SimpleNamespace(channel="")}
    return SimpleNamespace(file=file, model=SimpleNamespace(inputs=inputs, outputs=outputs))


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


PUSHED = """
name = "pushed"
summary = "A mass that is pushed."
inputs.force = { unit = "N" }
parameters.m = { unit = "kg", low = 1e-3 }
outputs.acceleration = { unit = "m/s^2", expression = "force/m" }
"""
UNITS = {"force": "N", "position": "m"}
ACCELERATION = (
    'derive = { low_pass = 20.0, signals.acceleration = { channel = "position", order = 2 } }'
)


LEFT_OF_NOISE = 2.8e-3
"""What noise of 1 µm in the position leaves in its second derivative, by the low-pass [m/s²]."""


def pushed(seed: int, mass: float = 0.5, width: float = 2.0) -> dict[str, np.ndarray]:
    """A position in closed form, and the force that causes it.

    After `width` s it has grown or faded by 60 %, so that 2 s of 20 begin and end at rest.
    """
    since, turn = DT * (np.arange(4000) - 2000), 2 * np.pi * 0.8
    wave, slope = np.sin(turn * since + seed), turn * np.cos(turn * since + seed)
    grown = np.exp(-(since**2) / (2 * width**2))
    rate, bend = -since / width**2 * grown, (since**2 / width**4 - 1 / width**2) * grown
    noise = 1e-6 * np.random.default_rng(seed).normal(size=len(since))
    force = mass * (bend * wave + 2 * rate * slope - grown * turn**2 * wave)
    return {"force": force, "position": grown * wave + noise}


@pytest.mark.parametrize("width", [2.0, 1000.0], ids=["rests at its ends", "moves at its ends"])
def test_a_right_model_of_a_derived_output_is_at_its_noise(tmp_path: Path, width: float) -> None:
    rates = (1 / DT, 1 / DT)
    logs = [pushed(1, width=width)], [pushed(2, width=width)]
    found = compare(studied(tmp_path, PUSHED, *logs, UNITS, ACCELERATION, rates))
    assert found.parameters["m"].value == pytest.approx(0.5, rel=2e-3)
    assert found.noise_floor == pytest.approx(found.held_out_error, rel=0.25)
    assert found.held_out_error < 2 * LEFT_OF_NOISE
