"""A base that leaves a little more than noise is replaced by one closer to the healthy machine."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare import Bench, open_bench
from rigwatch.workbench.explain import explained
from rigwatch.workbench.explain.adequacy import closer_base
from rigwatch.workbench.explain.explain import unless_two
from rigwatch.workbench.ranking import no_progress
from tests.variants.pushed import DAMPER, MODEL, RATE, SPRING, pushed
from tests.workbench.machine import studied, with_healthy

UNITS = {"voltage": "V", "position": "m", "acceleration": "m/s^2"}
NOISE = 0.45
"""Of the accelerometer: the model without the variant leaves 1.4 times as much [m/s^2]."""


def bench(folder: Path, compressed: float, spring: float = 60.0, damper: float = 0.0) -> Bench:
    """A stiffer spring [N/m] and a damper [N s/m] are hidden beside what the motion may do to the
    pressure [Pa/m].
    """
    time, lines = np.arange(round(20.0 * RATE)) / RATE, np.arange(2, 41) / 4.0
    phases = np.random.default_rng(4).uniform(0.0, 2.0 * np.pi, len(lines))
    volts = 0.3 * np.cos(2.0 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    train, held_out, healthy = (
        pushed(
            volts,
            compressed,
            seed,
            spring=SPRING + more * spring,
            damper=DAMPER + more * damper,
            noise=NOISE,
        )
        for seed, more in enumerate((1.0, 1.0, 0.0))
    )
    made = studied(folder, MODEL, [train], [held_out], UNITS, rates=[RATE, RATE])
    return open_bench(with_healthy(made, healthy, UNITS, RATE))


def test_the_variant_that_leaves_less_of_the_healthy_recording_is_taken(tmp_path: Path) -> None:
    closer = closer_base(bench(tmp_path, 2e4), no_progress)

    assert closer is not None
    assert closer.study.file.variants == ("compressed",)
    assert closer.bare is not None
    assert closer.bare.held_out_error == pytest.approx(NOISE, rel=0.05)
    assert any("judged on the model with compressed" in each for each in closer.data.remarks)


def test_a_base_that_leaves_noise_stays(tmp_path: Path) -> None:
    assert closer_base(bench(tmp_path, 0.0), no_progress) is None


@pytest.mark.nightly
def test_two_effects_at_once_are_told_on_its_own_base_and_undetermined_on_another(
    tmp_path: Path,
) -> None:
    two = explained(bench(tmp_path, 2e4, spring=100.0, damper=4.0)).explanation

    assert two.verdict == "missing_effect"
    elsewhere = unless_two(two)
    assert elsewhere.verdict == "undetermined"
    assert (elsewhere.also, elsewhere.ranking) == (two.also, two.ranking)
    assert elsewhere.text.startswith(f"likely, not certain: {two.text}; two effects at once")
    assert elsewhere.wrong_probability is None


def test_one_effect_is_told_on_another_base_as_well(tmp_path: Path) -> None:
    one = explained(bench(tmp_path, 2e4)).explanation

    assert (one.verdict, one.also) == ("missing_effect", [])
    assert unless_two(one) is one
