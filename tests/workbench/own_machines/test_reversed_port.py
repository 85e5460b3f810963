"""A force port of the wrong sign: friction there would drive, and nothing else is named for it."""

from pathlib import Path

import pytest

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.machine import studied
from tests.workbench.own_machines.test_noisier_training import DAMPER, run

UNITS = {"v": "m/s", "force": "N"}


@pytest.mark.parametrize("noise", [0.01, pytest.param(0.1, marks=pytest.mark.nightly)])
def test_a_port_of_the_wrong_sign_is_told_and_no_effect_is_named(
    tmp_path: Path, noise: float
) -> None:
    wrong = DAMPER.replace("c*v - load", "c*v + load")
    bench = open_bench(studied(tmp_path, wrong, [run(1, noise, 0.3)], [run(2, noise, 0.3)], UNITS))
    verdict = ranking(bench)[1]
    assert verdict.word == "unknown_effect"
    assert "quadratic_drag@load would explain" in verdict.text
    assert "port load may have the wrong sign" in verdict.text


def test_a_port_of_the_right_sign_is_not_suspected(tmp_path: Path) -> None:
    bench = open_bench(studied(tmp_path, DAMPER, [run(1, 0.02)], [run(2, 0.02)], UNITS))
    verdict = ranking(bench)[1]
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "quadratic_drag@load")
    assert "wrong sign" not in verdict.text
