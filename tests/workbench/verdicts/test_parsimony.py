"""Of equals the one with fewer parameters; what was left aside for another that fails is fitted."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.explain.explain import explain
from tests.workbench.dampers import damper, effect

WIDTH = "unit = '{v}', role = 'constant', value = 0.003"
STRENGTH = "unit = '{F}', role = 'strength'"


def rough(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Dry friction, and a little that no effect describes."""
    waves = 1.2 * np.sin(2 * np.pi * x / 0.006) + 0.12 * np.cos(2 * np.pi * x / 0.002)
    return np.asarray(4 * np.tanh(v / 0.003) + waves)


RICHER = effect(
    "richer",
    "-F*tanh(v/w) - k*F*cos(x/c)",
    F=STRENGTH,
    k="unit = '1', role = 'shape', value = 0.02",
    w=WIDTH,
    c="unit = '{x}', role = 'constant', value = 3.183e-4",
)


PLAIN = effect("plain", "-F*tanh(v/w)", F=STRENGTH, w=WIDTH)


def test_a_further_parameter_that_gains_next_to_nothing_is_not_named(tmp_path: Path) -> None:
    found = explain(damper(tmp_path, rough, PLAIN + RICHER))
    errors = {row.effect: row.held_out_error for row in found.ranking if row.held_out_error}
    assert 0.99 * errors["plain"] < errors["richer"] < errors["plain"]
    assert found.ranking[0].effect == "plain"
    assert "richer@load" in found.text


BRITTLE = effect("brittle", "-tanh(v/w)*(1 - sqrt(1 - 2*F/G))*G", F=STRENGTH, w=WIDTH,
                 G="unit = '{F}', role = 'constant', value = 1.0")  # fmt: skip


def test_what_looks_like_an_effect_that_cannot_be_fitted_is_fitted_instead(tmp_path: Path) -> None:
    found = explain(damper(tmp_path, rough, BRITTLE))
    rows = {row.effect: row for row in found.ranking}
    assert rows["brittle"].reason == "cannot be fitted"
    assert found.ranking[0].effect == "coulomb"
    assert rows["coulomb"].accepted
