"""`rigwatch commission --set`: what a user knows of the equations is not fitted."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from monitor.commissioning.equations.fitted_equations import fitted_equations
from monitor.signals.recordings import Recording, recording_of
from rigwatch.commands import main
from rigwatch.wire.arrays import FloatArray

MODEL, RATE, MASS, DAMPER, SPRING = "mass-spring-damper", 256.0, 2.0, 20.0, 2000.0


def shaken(name: str, force: FloatArray, seed: int) -> Recording:
    """A mass on a spring under a force that is held from sample to sample, with noisy sensors."""
    random = np.random.default_rng(seed)
    (b,), a, _ = cont2discrete(([1.0], [MASS, DAMPER, SPRING]), 1.0 / RATE, "zoh")
    (b2,), a2, _ = cont2discrete(([1.0, 0.0, 0.0], [MASS, DAMPER, SPRING]), 1.0 / RATE, "zoh")
    position = lfilter(b, a, force) + 2e-6 * random.standard_normal(force.size)
    acceleration = lfilter(b2, a2, force) + 0.02 * random.standard_normal(force.size)
    channels = {"force": force, "position": position, "acceleration": acceleration}
    return recording_of("healthy", name, RATE, channels)


@pytest.fixture(scope="module")
def recordings() -> list[Recording]:
    """Two tones."""
    turns = 2.0 * np.pi * np.arange(round(12.0 * RATE)) / RATE
    return [
        shaken("fast", 14.0 * np.sin(8.0 * turns), 1),
        shaken("slow", 14.0 * np.sin(4.3 * turns), 2),
    ]


@pytest.mark.parametrize("stated", [{}, {"m": 2.05}], ids=["fitted", "stated"])
def test_a_mass_that_is_stated_is_the_model_s(
    recordings: list[Recording], stated: dict[str, float]
) -> None:
    plant = fitted_equations(recordings, MODEL, 2.0, RATE, [False] * len(recordings), stated)

    mass = dict(zip(plant.names, plant.values, strict=True))["m"]
    if stated:
        assert mass == stated["m"]
    else:
        assert mass == pytest.approx(MASS, rel=0.02)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("mass=0.3",), "servo-pneumatic: found no parameter 'mass'"),
        (("m=-0.3",), "servo-pneumatic: found m = -0.3, expected at least 0.01 kg"),
        (("m=nan",), "servo-pneumatic: found m = nan"),
        (("m",), "--set: found 'm', expected NAME=VALUE such as m=0.31"),
        (("m=300 g",), "such as m=0.31; a unit stands in brackets: 'm=300[g]'"),
        (("m=0.3", "--scheme", "transfer"), "--set: found no model of equations"),
        (("m=0.3", "--plant", "inertia"), "--set: found no model of equations"),
    ],
    ids=["unknown", "negative", "no number", "no value", "unit", "transfer function", "inertia"],
)
def test_what_cannot_be_stated_is_refused_before_anything_is_read(
    words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = str(tmp_path / "none.mcap")

    code = main(
        ["commission", "--healthy", nowhere, "--output", str(tmp_path / "m.toml"), "--set", *words]
    )

    assert code != 0
    assert said in capsys.readouterr().err
