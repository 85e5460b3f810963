"""A slide that binds on a part of its travel is found, though another effect is best first."""

from pathlib import Path

import pytest

from rigwatch.workbench.explain.explain import ranking
from tests.workbench.rigs.slides import RAMP, Hidden, bench

FORCE = 0.8


@pytest.mark.parametrize("place", [pytest.param(-0.012, marks=pytest.mark.nightly), 0.008])
def test_the_place_where_a_slide_binds_is_found(tmp_path: Path, place: float) -> None:
    rows, verdict = ranking(bench(tmp_path, Hidden(dent=FORCE, place=place)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "local_binding@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_local_binding_xb"] - place) < 5e-4
    assert abs(values["load_local_binding_Fb"] / FORCE - 1) < 0.1


@pytest.mark.parametrize(
    ("side", "name", "begins"),
    [
        (1.0, "binding_past", 0.004 + RAMP / 2),
        (-1.0, "binding_before", 0.004 - RAMP / 2),
        (0.0, "binding_outside", 0.004),
    ],
)
def test_the_part_on_which_a_slide_binds_is_found(
    tmp_path: Path, side: float, name: str, begins: float
) -> None:
    rows, verdict = ranking(bench(tmp_path, Hidden(tight=FORCE, side=side, place=0.004)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == f"{name}@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values[f"load_{name}_xb"] - begins) < 1e-3
    assert abs(values[f"load_{name}_Fb"] / FORCE - 1) < 0.1
