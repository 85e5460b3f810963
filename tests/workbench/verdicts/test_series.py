"""Effects in series, hidden in a mass of other equations: named, and their parts are not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.equations import library, shipped_models
from rigwatch.physics.engine.fit import Recording
from rigwatch.workbench.compare import bench_of
from rigwatch.workbench.data import Data
from rigwatch.workbench.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.study import Span, Study, StudyFile
from sim_plant.specimens import specimen
from sim_plant.specimens.specimen import NOISE
from tests.workbench.simulated import multisine, opened

SAMPLES, HORIZON = 1024, 128


def verdict(name: str, *, whole_library: bool = True) -> Verdict:
    """The verdict on a mass with an effect, fitted to one recording and judged on another."""
    tried = specimen(name)
    made = [tried.record(seed, hidden=True, samples=SAMPLES) for seed in (1, 2)]
    train, held_out = (Recording(r.dt, r.inputs, r.outputs, parts=(SAMPLES,)) for r in made)
    healthy = tried.record(3, hidden=False, samples=SAMPLES)
    quiet = Recording(healthy.dt, healthy.inputs, healthy.outputs, parts=(SAMPLES,))
    span = (Span(session="simulated"),)
    file = StudyFile(
        model=tried.machine.model, train=span, held_out=span, whole_library=whole_library
    )
    study = Study(Path(), file, shipped_models()[file.model], library(), frozenset())
    scale = NOISE * np.nanstd(made[0].outputs, axis=0)
    _, found = ranking(bench_of(study, Data(train, held_out, quiet, HORIZON, ()), scale))
    return found


COMPOSITE = "viscous_behind_play"


@pytest.mark.nightly
def test_a_composite_is_named() -> None:
    found = verdict(COMPOSITE)
    assert found.word == "missing_effect"
    assert {*found.members} & {*specimen(COMPOSITE).named}


@pytest.mark.nightly
def test_without_the_composite_none_of_its_parts_is_named() -> None:
    assert verdict(COMPOSITE, whole_library=False).word == "unknown_effect"


@pytest.mark.nightly
def test_dry_friction_alone_is_not_called_a_slider_behind_a_gap() -> None:
    force = multisine(np.arange(0.2, 6.0, 0.2), 3.0)
    bench = opened(force, "coulomb")
    file = structs.replace(bench.study.file, whole_library=True)
    _, found = ranking(replace(bench, study=replace(bench.study, file=file)))
    assert found.word == "missing_effect"
    assert "coulomb@load" in found.members
    assert not {"slider_behind_gap@load", "viscous_behind_play@load"} & {*found.members}
