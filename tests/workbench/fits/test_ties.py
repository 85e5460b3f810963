"""Parameters that a recording ties to each other end at one place, wherever a fit begins."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.compare.compare import Comparison, compare
from rigwatch.workbench.fit import fit_model
from rigwatch.workbench.ranking import candidates, refit, scored
from rigwatch.workbench.study import Accepted
from tests.workbench.dampers import damper
from tests.workbench.machine import studied

TWO_PADS = """
name = "two pads"
summary = "Friction of two pads under pressures of their own."
inputs.one = { unit = "N" }
inputs.other = { unit = "N" }
parameters.a = { value = 0.4, unit = "1", low = -1e3, high = 1e3 }
parameters.b = { value = 0.4, unit = "1", low = -1e3, high = 1e3 }
outputs.force = { unit = "N", expression = "a**2*one + b**2*other" }
"""
UNITS = {"one": "N", "other": "N", "force": "N"}


def pressed(seed: int, apart: float) -> dict[str, np.ndarray]:
    """Both pressures go up and down together but for a share."""
    generator = np.random.default_rng(seed)
    one = 10 + np.convolve(generator.normal(size=840), np.ones(41) / 5, "valid")
    other = one + apart * np.convolve(generator.normal(size=840), np.ones(41) / 5, "valid")
    force = 0.25 * one + 0.36 * other + 0.1 * generator.normal(size=800)
    return {"one": one, "other": other, "force": force}


def compared(folder: Path, start: str, together: float = 1e-4) -> Comparison:
    train, held_out = [pressed(0, together)], [pressed(1, 1.0)]
    return compare(studied(folder, TWO_PADS, train, held_out, UNITS, f"start = {{ {start} }}"))


STARTS = ["a = 0.7, b = 0.01", "a = 0.01, b = 0.7", "a = 5.0, b = -4.0", "a = 0.4, b = 0.4"]


def test_the_held_out_error_does_not_depend_on_the_start(tmp_path: Path) -> None:
    found = [compared(tmp_path / str(i), start) for i, start in enumerate(STARTS)]
    for each in found:
        assert each.train_error == pytest.approx(found[0].train_error, rel=0.005)
        assert each.held_out_error == pytest.approx(found[0].held_out_error, rel=0.02)
        assert "tied to" in each.parameters["a"].note


def test_what_the_recording_tells_stays_as_it_was(tmp_path: Path) -> None:
    found = compared(tmp_path, "a = 0.7, b = 0.3", together=1.0).parameters
    assert found["a"].value == pytest.approx(0.5, rel=0.02)
    assert found["b"].value == pytest.approx(0.6, rel=0.02)


def slipping(x: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Force of a slider behind a spring, 150 kN."""
    force = np.zeros(len(x))
    for k in range(1, len(x)):
        force[k] = np.clip(force[k - 1] + 8e7 * (x[k] - x[k - 1]), -1.5e5, 1.5e5)
    return force


def test_a_second_strong_friction_costs_no_error(tmp_path: Path) -> None:
    study = damper(tmp_path, slipping)
    with_one = study.with_effects([Accepted(effect="jenkins", port="load")])
    bench = open_bench(with_one)
    found = candidates(with_one, bench.data.train)
    for label in ("bouc_wen@load", "dahl@load"):
        every = scored(with_one, bench.data, bench.base, found, every=True)
        row = next(row for row in every if row.label == label)
        refit(with_one, bench.data, bench.base, row, fit_model)
        assert row.fitted is not None
        assert row.fitted.train_error < 1.05 * bench.base.train_error
