"""Laws with a middle that is not where position reads zero are found, alone and in pairs."""

from pathlib import Path

import pytest

from rigwatch.workbench.explain.explain import ranking
from tests.workbench.rigs.slides import MIDDLE, Hidden, bench

CUBIC, BINDING, DRY = 4e4, 20.0, 0.15


def test_the_middle_of_a_stiffening_spring_is_found(tmp_path: Path) -> None:
    rows, verdict = ranking(bench(tmp_path, Hidden(cubic=CUBIC)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "cubic_stiffness_off_middle@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_cubic_stiffness_off_middle_x0"] - MIDDLE) < 3e-4
    assert abs(values["load_cubic_stiffness_off_middle_k3"] / CUBIC - 1) < 0.05


def test_the_middle_from_which_a_slide_binds_is_found(tmp_path: Path) -> None:
    rows, verdict = ranking(bench(tmp_path, Hidden(binding=BINDING)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "binding_off_middle@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_binding_off_middle_xm"] - MIDDLE) < 1e-4
    strength = values["load_binding_off_middle_Fb"] / values["load_binding_off_middle_xe"]
    assert abs(strength / BINDING - 1) < 0.05


@pytest.mark.nightly
def test_beside_dry_friction_a_pair_finds_the_middle_of_a_spring(tmp_path: Path) -> None:
    _, verdict = ranking(bench(tmp_path, Hidden(cubic=CUBIC, dry=DRY)))

    assert verdict.word in {"missing_effect", "undetermined"}, verdict.text
    named = {*verdict.members, *verdict.second}
    assert {"coulomb@load", "cubic_stiffness_off_middle@load"} <= named
