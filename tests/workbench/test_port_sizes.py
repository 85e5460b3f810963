"""Sizes of what acts at a port, to which the bounds and starting values of effects are scaled."""

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit import Recording
from rigwatch.workbench.data import port_sizes

RATE = 500.0
TIME = np.arange(6000) / RATE


def speeds(twist: float, noise: float = 0.02) -> Recording:
    """Both speeds of a two-mass drive whose shaft is twisted by an amplitude [rad], at 3 Hz."""
    turned = 2 * np.pi * 3.0
    load = 5 * np.cos(2 * np.pi * 0.5 * TIME)
    motor = load + twist * turned * np.cos(turned * TIME)
    random = np.random.default_rng(3)
    read = np.column_stack([motor, load]) + noise * random.standard_normal((len(TIME), 2))
    return Recording(1 / RATE, np.ones((len(TIME), 1)), read)


@pytest.mark.parametrize("twist", [0.01, 0.3])
def test_a_twist_that_nobody_measures_has_the_size_of_the_travel(twist: float) -> None:
    sizes = port_sizes(shipped_models()["two-mass-drive"], speeds(twist))
    assert sizes["coupling"]["x"] == pytest.approx(twist / np.sqrt(2), rel=0.1)
    assert sizes["drive"]["x"] == pytest.approx(5 / np.pi / np.sqrt(2), rel=0.1)
    gap = library()["backlash"].scaled(sizes["coupling"]).parameters["g"]
    assert 0.05 * twist < gap.value < twist < 2 * gap.high


def test_a_measured_position_has_its_own_size() -> None:
    model = shipped_models()["mass-spring-damper"]
    read = np.column_stack([0.2 + 0.1 * np.sin(TIME), np.cos(TIME)])
    sizes = port_sizes(model, Recording(1 / RATE, np.ones((len(TIME), 1)), read))
    assert sizes["load"]["x"] == pytest.approx(np.sqrt(np.mean(read[:, 0] ** 2)))
