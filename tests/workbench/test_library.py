"""Effects of the library: scores name each in a machine of other equations, among all others."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking.scoring import rank_all
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Accepted, Span, StudyFile
from sim_plant.specimens import HIDDEN, specimen
from sim_plant.specimens.specimen import NOISE

SAMPLES, HORIZON = 640, 128
LEAST = 60
"""Effects that the library holds at least."""
HELD_ALREADY = {"convection"}
"""The heated block conducts to its surroundings by the same law."""


def test_every_effect_of_the_library_is_hidden_somewhere() -> None:
    assert set(HIDDEN) == set(library()) - HELD_ALREADY


def _by_night(name: str) -> tuple[pytest.MarkDecorator, ...]:
    """The rarer half of the library is tried by night: all together take a minute."""
    return (pytest.mark.nightly,) if library()[name].elective else ()


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=_by_night(name)) for name in sorted(HIDDEN)]
)
def test_an_effect_is_named_first_or_in_the_class_of_the_first(name: str) -> None:
    tried = specimen(name)
    made = tried.record(1, hidden=True, samples=SAMPLES)
    recording = Recording(made.dt, made.inputs, made.outputs)
    data = Data(recording, recording, None, HORIZON, ())
    span = (Span(session="simulated"),)
    known = tuple(
        Accepted(effect=label.split("@")[0], port=label.split("@")[1]) for label in tried.known
    )
    model = tried.machine.model
    file = StudyFile(model=model, train=span, held_out=span, effects=known, whole_library=True)
    study = Study(Path(), file, shipped_models()[file.model], library(), frozenset())

    bench = bench_of(study, data, NOISE * np.nanstd(made.outputs, axis=0))
    first = rank_all(bench.study, data, bench.base)[0]

    assert set(tried.named) & {first.label, *first.alike}


def _accepted(effect: str, port: str) -> Accepted:
    return Accepted(effect=effect, port=port)


def test_the_library_tells_of_each_effect_what_looks_like_it() -> None:
    effects = library()

    assert len(effects) >= LEAST
    for name, effect in effects.items():
        assert effect.confused_with, name
        assert set(effect.confused_with) <= set(effects) - {name}, name
        assert not effect.refines or effect.refines in effects, name


def test_every_effect_of_a_file_stands_in_one_file_alone() -> None:
    folder = Path(__file__).parents[2] / "rigwatch" / "physics" / "effects"
    heads = [
        line
        for file in sorted(folder.glob("*.toml"))
        for line in file.read_text("utf-8").splitlines()
        if line.startswith(("[effects.", "[composites."))
    ]

    assert len(heads) == len(set(heads)) == len(library())
