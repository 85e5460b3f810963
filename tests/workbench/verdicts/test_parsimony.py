"""Of equals the one with fewer parameters; what was left aside for another that fails is fitted.

So is what a score to first order underrates.
"""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.explain.explain import explain
from tests.workbench.dampers import damper, effect
from tests.workbench.machine import studied

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
    found = explain(damper(tmp_path, lambda _, v: 4 * np.sign(v), BRITTLE))
    rows = {row.effect: row for row in found.ranking}
    assert rows["brittle"].reason == "cannot be fitted"
    assert found.ranking[0].effect == "coulomb"
    assert rows["coulomb"].accepted


CASCADE = """
name = "cascade"
summary = "Two tanks, one above the other, that a pump fills from empty; nothing else drives them."
quantities.jet1 = { expression = "c1*h1*sqrt(2*g/(abs(h1) + ht))", unit = "m^3/s" }
quantities.jet2 = { expression = "c2*h2*sqrt(2*g/(abs(h2) + ht))", unit = "m^3/s" }
states.h1 = { unit = "m", derivative = "(q - jet1 + leak1)/A", measured = "h_1" }
states.h2 = { unit = "m", derivative = "(jet1 - jet2 + leak2)/A", measured = "h_2" }
parameters.g = { value = 9.81, unit = "m/s^2", fixed = true }
parameters.ht = { value = 1e-4, unit = "m", fixed = true }
parameters.A = { value = 0.00875, unit = "m^2", fixed = true }
parameters.q = { value = 5e-5, unit = "m^3/s", low = 0.0 }
parameters.c1 = { value = 2e-5, unit = "m^2", low = 0.0 }
parameters.c2 = { value = 2e-5, unit = "m^2", low = 0.0 }
outputs.h_1 = { unit = "m", expression = "h1" }
outputs.h_2 = { unit = "m", expression = "h2" }
[ports.leak1]
kind = "force"
unit = "m^3/s"
variables.p = { expression = "h1", unit = "m" }
[ports.leak2]
kind = "force"
unit = "m^3/s"
variables.p = { expression = "h2", unit = "m" }
[ports.level1]
kind = "sensor"
signal = "h_1"
[ports.level2]
kind = "sensor"
signal = "h_2"
"""


def filling(seed: int, samples: int = 128) -> dict[str, np.ndarray]:
    """Levels read every 2 s, in steps of 20 ms; the zero of the upper one is off by 15 cm."""
    upper, lower, read = 0.05, 0.0, np.zeros((samples, 2))
    for i in range(samples):
        read[i] = upper - 0.15, lower
        for _ in range(100):
            through = 4.5e-5 * np.sqrt(2 * 9.81 * upper)
            upper += 0.02 * (9.9e-5 - through) / 0.00875
            lower += 0.02 * (through - 5e-5 * np.sqrt(2 * 9.81 * lower)) / 0.00875
    read += 0.001 * np.random.default_rng(seed).normal(size=read.shape)
    return {"h_1": read[:, 0], "h_2": read[:, 1]}


@pytest.mark.nightly
def test_a_zero_that_is_off_is_named_although_the_root_of_a_jet_hides_it(tmp_path: Path) -> None:
    logs, units = [filling(seed) for seed in (0, 1)], {"h_1": "m", "h_2": "m"}
    found = explain(studied(tmp_path, CASCADE, logs[:1], logs[1:], units, rates=[0.5, 0.5]))
    assert found.verdict == "missing_effect"
    assert (found.ranking[0].effect, found.ranking[0].port) == ("offset", "level1")
