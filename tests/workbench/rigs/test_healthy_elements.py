"""A base that lacks what the healthy machine has: the element is found, and a fault beside it."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.adequacy import with_adequate_base
from rigwatch.workbench.explain.explain import explain, explained
from rigwatch.workbench.ranking import no_progress
from rigwatch.workbench.study.elements import elements_of
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.fits.test_strength_intervals import MODEL, RATE, slide
from tests.workbench.machine import Table, studied, with_healthy
from tests.workbench.simulated import COMMON, knowing

UNITS = {"u": "N", "position": "m", "acceleration": "m/s^2"}
HEALTHY, FAULT = 0.5, 0.25
"""Dry friction of the healthy slide and of its fault [N]."""


def table(seed: int, friction: float) -> Table:
    """A recording of a slide with this dry friction, its position a sample late."""
    made = slide(seed, friction, 0.0, 0.03)
    columns = np.column_stack([made.inputs, made.outputs]).T
    u, position, acceleration = columns
    late = np.concatenate([position[:1], position[:-1]])
    return dict(zip(UNITS, (u, late, acceleration), strict=True))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """The study of a slide that rubs more than a healthy one; its model does not rub at all."""
    return rubbing(tmp_path_factory.mktemp("slide"), HEALTHY)


def rubbing(folder: Path, healthy: float) -> Study:
    """The study of a slide that rubs by `FAULT` more than a healthy one [N]."""
    train, held_out = ([table(seed, healthy + FAULT)] for seed in range(2))
    made = studied(folder, MODEL, train, held_out, UNITS, rates=[RATE] * 2)
    return knowing(with_healthy(made, table(2, healthy), UNITS, RATE), *COMMON)


def test_more_friction_is_named_beside_what_the_healthy_slide_has(study: Study) -> None:
    found = explain(study)
    assert found.verdict == "missing_effect", found.text
    best = found.ranking[0]
    strength = best.parameters[study.effect(best.effect).strength]
    assert (best.effect, best.port) == ("coulomb", "load")
    assert "the healthy machine has coulomb@load already" in found.text
    assert strength.value == pytest.approx(FAULT, rel=0.15)
    (told,) = (r for r in found.comparison.remarks if r.startswith("judged on the model with"))
    (element,) = elements_of([told.split("with ")[1].split(",")[0]])
    assert element.values["Fc"] == pytest.approx(HEALTHY, rel=0.1)
    assert open_study(study.folder).file.variants == ()


@pytest.mark.parametrize("healthy", [0.0, 0.012])
def test_a_base_that_leaves_little_more_than_noise_is_bettered(
    tmp_path: Path, healthy: float
) -> None:
    """The model has neither the slide's cubic spring nor its drive's saturation."""
    study = rubbing(tmp_path, healthy)
    own = open_bench(study)
    assert own.bare is not None
    better = with_adequate_base(own, no_progress)
    assert better.bare is not None
    assert better.bare.held_out_error < 0.8 * own.bare.held_out_error
    found = explained(better).explanation
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "coulomb"), found.text
    strength = found.ranking[0].parameters["Fc"]
    assert strength.value == pytest.approx(FAULT, rel=0.15)
    assert any(r.startswith("judged on the model with") for r in found.comparison.remarks)


def test_an_element_is_taken_shown_and_undone(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(study.folder)
    assert main(["study", "base", folder, "--take", "coulomb@load(Fc=0.5)"]) == 0
    assert open_study(folder).file.variants == ("coulomb@load(Fc=0.5)",)
    capsys.readouterr()
    assert main(["study", "show", folder]) == 0
    assert "with coulomb@load(Fc=0.5): " in capsys.readouterr().out
    assert main(["undo", folder]) == 0
    assert open_study(folder).file.variants == ()


def test_an_element_that_cannot_be_read_is_one_line() -> None:
    with pytest.raises(ModelError, match="expected a variant of the model or an effect at a port"):
        elements_of(["coulomb@load(Fc: 0.5)"])


def test_an_unknown_port_or_effect_is_told(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, told in (("coulmb@load", "coulomb"), ("coulomb@laod", "load")):
        assert main(["study", "base", str(study.folder), "--take", name]) != 0
        assert told in capsys.readouterr().err
    assert open_study(study.folder).file.variants == ()
