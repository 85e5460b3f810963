"""Laws that the healthy recording leaves open widen the interval of a strength.

An accelerometer that reads too little and a slide with weaker springs, damper and motor look alike
as long as nothing is missing; a friction that is added does not weaken with them.
"""

from pathlib import Path

import pytest

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.workbench.compare.bases.model_form import variances_between_bases
from rigwatch.workbench.compare.preparation import bench_of, determined_by_healthy
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tests.workbench.fits.test_strength_intervals import MODEL, STRENGTH, slide

READS_LESS = """
[variants.reads_less]
physics = "The accelerometer reads a tenth too little."
group = "sensor"
outputs.acceleration = { unit = "m/s^2", expression = "0.9*acceleration" }
"""
NO_SPRING = """
[variants.no_spring]
physics = "Nothing pulls the slide back."
group = "spring"
parameters.k = { value = 0.0, unit = "N/m", fixed = true }
"""
FRICTION = 0.2


def deviation(variants: str) -> float:
    """Standard deviation of the friction between bases, over the friction found."""
    name, text = "slide.toml", MODEL + variants
    made = [slide(k, FRICTION, 0.0, 0.03) for k in range(2)]
    data = Data(*made, slide(2, 0.0, 0.0, 0.03), 128, ())
    span = (Span(session="simulated"),)
    file = StudyFile(model=name, train=span, held_out=span, healthy=span)
    study = Study(
        Path(), file, parse_model(text, name), library(), frozenset(), own_files={name: text}
    )
    bench = bench_of(*determined_by_healthy(study, data))
    effect = bench.study.effect_at("coulomb", "load").scaled({"x": 0.01, "v": 0.1, "F": 1.0})
    start = bench.base.train.values() | {STRENGTH: FRICTION}
    placements = (Placement("coulomb", effect, "load"),)
    found = fit_model(bench.study, bench.data, placements, start, bench.base.train.scale)
    variances = variances_between_bases(bench.study, bench.data, bench.bare, found)
    return variances.get(STRENGTH, 0.0) ** 0.5 / found.train.values()[STRENGTH]


def test_a_law_that_the_healthy_recording_leaves_open_is_counted() -> None:
    assert deviation(READS_LESS) == pytest.approx(1 / 0.9 - 1, rel=0.2)


@pytest.mark.parametrize("variants", [NO_SPRING, ""])
def test_a_law_that_the_healthy_recording_refutes_is_not(variants: str) -> None:
    assert deviation(variants) == 0.0
