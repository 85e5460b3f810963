"""Answers on machines that hide several effects: each is judged by what is still hidden."""

import pytest

from sim_plant.machines import Answer, judged

COULOMB, FAN, CLIPS = "coulomb@shaft", "quadratic_drag@shaft", "saturation@drive"


@pytest.mark.parametrize(
    ("word", "members", "rivals", "second", "how_good"),
    [
        ("missing_effect", (COULOMB,), (), (), "right"),
        ("missing_effect", (COULOMB,), (), (FAN,), "right"),
        ("missing_effect", (COULOMB,), (), (CLIPS,), "wrong"),
        ("missing_effect", ("stribeck@shaft",), (COULOMB,), (), "wrong"),
        ("undetermined", ("stribeck@shaft",), (COULOMB,), (), "undecided"),
        ("undetermined", ("stribeck@shaft",), (CLIPS,), (), "astray"),
        ("nothing_missing", (), (), (), "wrong"),
        ("unknown_effect", (COULOMB,), (), (), "unknown"),
    ],
)
def test_an_answer_is_judged_by_what_is_still_hidden(word, members, rivals, second, how_good):
    assert judged("motor", ["coulomb", "fan"], Answer(word, members, rivals, second))[0] == how_good


def test_once_all_is_found_nothing_may_be_missing():
    assert judged("motor", [], Answer("nothing_missing"))[0] == "ended"
    assert judged("motor", [], Answer("missing_effect", (COULOMB,)))[0] == "more"
