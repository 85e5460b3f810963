"""Steps of a chain of hidden effects: each is judged by what is still hidden."""

import pytest

from benchmarks.explaining.chains import judged_step
from rigwatch.workbench.explain.verdict import Verdict


@pytest.mark.parametrize(
    ("word", "members", "rivals", "second", "judged"),
    [
        ("missing_effect", ("coulomb@shaft",), (), (), "right"),
        ("missing_effect", ("coulomb@shaft",), (), ("quadratic_drag@shaft",), "right"),
        ("missing_effect", ("coulomb@shaft",), (), ("saturation@drive",), "wrong"),
        ("missing_effect", ("stribeck@shaft",), ("coulomb@shaft",), (), "wrong"),
        ("undetermined", ("stribeck@shaft",), ("coulomb@shaft",), (), "undecided"),
        ("undetermined", ("stribeck@shaft",), ("saturation@drive",), (), "astray"),
        ("nothing_missing", (), (), (), "wrong"),
        ("unknown_effect", ("coulomb@shaft",), (), (), "unknown"),
    ],
)
def test_a_step_is_judged_by_what_is_still_hidden(word, members, rivals, second, judged):
    verdict = Verdict(word, None, members, rivals, "", second)
    assert judged_step("motor", ["coulomb", "fan"], verdict)[0] == judged
