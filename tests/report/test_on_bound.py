"""An effect whose own parameter ends on a bound is named with that."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.browser.views import study_view
from rigwatch.workbench.explain import Explanation, explain
from rigwatch.workbench.fit import Value
from rigwatch.workbench.report import explanation_lines
from rigwatch.workbench.report.sections import headline
from tests.workbench.dampers import damper, effect
from tests.workbench.simulated import knowing

TOLD = "its vs (0.005 m/s) is on a bound: the recordings may ask for another shape"


def rounded(highest: float) -> str:
    """Friction that is round about zero speed, up to a speed of `highest`."""
    return effect(
        "rounded", "-F*tanh(v/vs)",
        F='role = "strength", unit = "N"',
        vs=f'role = "shape", value = 0.003, unit = "m/s", low = 0.001, high = {highest}',
    )  # fmt: skip


def explained(folder: Path, highest: float) -> Explanation:
    study = damper(folder, lambda x, v: 8 * np.tanh(v / 0.02), rounded(highest))
    return explain(knowing(study, "rounded", "constant_force", "linear_stiffness"))


def in_page(found: Explanation) -> str:
    """The heading of the report's page."""
    comparison: Any = SimpleNamespace(held_out_error=1.0, told=float, told_in="N")
    stage = SimpleNamespace(comparison=comparison)
    material: Any = SimpleNamespace(stages=[stage], explanation=found)
    return headline(material)


def in_browser(found: Explanation) -> str:
    """The heading of the study in the browser."""
    state: Any = SimpleNamespace(explanation=found)
    return study_view.headline(state)


def test_the_headline_says_that_the_effect_named_is_on_its_bound(tmp_path: Path) -> None:
    found = explained(tmp_path, 0.005)
    assert (found.verdict, found.on_bound) == ("missing_effect", ["vs"])
    assert explanation_lines(found)[0].endswith(TOLD)
    assert in_page(found).endswith(TOLD)
    assert in_browser(found).endswith(TOLD)


def test_it_says_nothing_of_a_shape_within_its_bounds(tmp_path: Path) -> None:
    found = explained(tmp_path, 0.5)
    assert (found.verdict, found.on_bound) == ("missing_effect", [])
    assert found.ranking[0].parameters["vs"].value == pytest.approx(0.02, rel=0.1)
    for told in (explanation_lines(found)[0], in_page(found), in_browser(found)):
        assert "bound" not in told


def test_several_bounds_are_told_and_none_where_no_effect_is_named(tmp_path: Path) -> None:
    found = explained(tmp_path, 0.005)
    own = {**found.ranking[0].parameters, "n": Value(2.0, "1", (1.9, 2.1))}
    both = replace(found, ranking=[replace(found.ranking[0], parameters=own)], on_bound=["vs", "n"])
    assert "; its vs (0.005 m/s) and n (2) are on bounds" in explanation_lines(both)[0]
    assert "bound" not in explanation_lines(replace(found, verdict="undetermined"))[0]
