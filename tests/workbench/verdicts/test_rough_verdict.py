"""What is not claimed: one effect where much is left, anything of a model that nobody checked."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.workbench.data.noise.error_spectrum import ErrorSpectrum
from rigwatch.workbench.data.noise.noise_floor import NoiseFloor
from rigwatch.workbench.explain.adequacy import unchecked
from rigwatch.workbench.explain.explain import _another_before
from rigwatch.workbench.explain.rough_verdict import (
    acts_alone,
    leaves_much,
    leaves_some,
    limited_verdict,
    undetermined_if_little_and_unexplained,
    undetermined_if_much_left,
)
from rigwatch.workbench.explain.verdict import Verdict


def left(times: float) -> Any:
    """A fit that leaves so many noise floors of the recordings held out."""
    held_out = SimpleNamespace(rms=np.array([times]))
    return SimpleNamespace(held_out=held_out, convergence=None, calm=None)


def naming(times: float, second: tuple[str, ...] = ()) -> Verdict:
    """A verdict that is sure of dry friction, which leaves so many noise floors."""
    row: Any = SimpleNamespace(fitted=left(times), label="coulomb@load", gain=None)
    return Verdict("missing_effect", row, ("coulomb@load",), (), "coulomb is missing", second)


def bench(base: float, *, healthy: bool = False, method: str = "quiet band") -> Any:
    """A study along the measured motion whose model leaves so many noise floors."""
    data = SimpleNamespace(healthy=object() if healthy else None, along_motion=True)
    return SimpleNamespace(data=data, base=left(base), floor=NoiseFloor(np.ones(1), method))


FLOOR = NoiseFloor(np.ones(1), "healthy motion")


def test_one_effect_that_leaves_much_of_a_rough_model_is_not_named_with_confidence() -> None:
    found = limited_verdict(left(4.0), [], FLOOR, naming(2.0))

    assert found.word == "undetermined"
    assert "leaves 2.00 times" in found.text
    assert undetermined_if_much_left(left(4.0), FLOOR, naming(2.0)) == found, (
        "nor of any other model"
    )


def test_a_strong_effect_may_leave_more_as_it_changes_the_motion() -> None:
    assert limited_verdict(left(28.0), [], FLOOR, naming(3.3)).word == "missing_effect"
    assert limited_verdict(left(7.3), [], FLOOR, naming(2.0)).word == "undetermined"


class ByFrequency:
    """A floor whose model's own error is one noise floor in every fit."""

    method, own_error = "healthy motion", True

    def beyond_own_error(self, before: Any, after: Any, _calm: None) -> float:
        """What is left of the square above it."""
        return float((after.rms[0] ** 2 - 1) / (before.rms[0] ** 2 - 1))


OWN: Any = ByFrequency()


@pytest.mark.parametrize(
    ("best", "beside", "word"),
    [
        pytest.param(1.55, (1.47, 1.52), "missing_effect", id="4 %, of which 82 % remain"),
        pytest.param(1.55, (1.2, 1.52), "undetermined", id="4 %, of which a second explains much"),
        pytest.param(1.8, (1.75, 1.79), "undetermined", id="6.4 %, whatever remains"),
        pytest.param(1.55, (), "undetermined", id="no second effect could be tried"),
        pytest.param(1.3, (), "missing_effect", id="2 %"),
    ],
)
def test_more_may_be_left_where_no_second_effect_explains_that(
    best: float, beside: tuple[float, ...], word: str
) -> None:
    base, found = left(6.0), naming(best)
    alone = acts_alone(base, OWN, found, [left(each) for each in beside])
    judged = undetermined_if_much_left(base, OWN, replace(found, alone=alone))
    assert judged.word == word
    told = "it leaves 4% of the error beyond" in judged.text
    assert told == (alone and word == "missing_effect")


def test_where_the_error_is_known_by_frequency_only_what_is_far_above_the_floor_is_more() -> None:
    """Beside dry friction a cubic spring left twice the floor, 2 % beyond the model's own error."""
    known = replace(FLOOR, own_error=ErrorSpectrum(np.ones((11, 1))))

    assert leaves_some(left(4.0), FLOOR, naming(1.3))
    assert not leaves_some(left(4.0), known, naming(1.3))
    assert leaves_some(left(9.0), known, naming(1.6))


def explained(label: str, times: float, *alike: str, accepted: bool = True) -> Any:
    """An explanation that names an effect, which leaves so many noise floors."""
    row = SimpleNamespace(label=label, accepted=accepted, fitted=left(times))
    told = SimpleNamespace(ranking=[SimpleNamespace(class_=list(alike))], rivals=[])
    return SimpleNamespace(rows=[row], explanation=told, bench=SimpleNamespace(floor=FLOOR))


@pytest.mark.parametrize(
    ("first", "second", "before"),
    [
        pytest.param(explained("a@x", 3.0), explained("b@x", 2.0), "a@x", id="another"),
        pytest.param(explained("a@x", 3.0), explained("a@x", 2.0), "", id="the same"),
        pytest.param(explained("a@x", 3.0), explained("b@x", 2.0, "a@x"), "", id="of its class"),
        pytest.param(explained("a@x", 3.0), explained("b@x", 1.2), "", id="little is left"),
        pytest.param(explained("a@x", 3.0, accepted=False), explained("b@x", 2.0), "", id="none"),
    ],
)
def test_what_led_before_is_a_rival_where_much_is_left(
    first: Any, second: Any, before: str
) -> None:
    assert _another_before(first, second) == before


@pytest.mark.parametrize("found", [naming(1.3), naming(2.0, ("cubic_stiffness@load",))])
def test_what_leaves_little_and_a_pair_stay_named(found: Verdict) -> None:
    assert not leaves_much(left(4.0), FLOOR, found)
    assert limited_verdict(left(4.0), [], FLOOR, found).word == "missing_effect"


@pytest.mark.parametrize(
    ("base", "best", "some"),
    [
        pytest.param(3.0, 1.17, True, id="a share that noise hides"),
        pytest.param(3.0, 1.04, False, id="at the floor"),
        pytest.param(28.0, 1.17, False, id="next to nothing of a strong effect"),
    ],
)
def test_a_share_above_the_floor_may_be_another_effect(
    base: float, best: float, some: bool
) -> None:
    assert leaves_some(left(base), FLOOR, naming(best)) == some
    assert not leaves_some(left(base), FLOOR, naming(best, ("cubic_stiffness@load",)))


@pytest.mark.parametrize(
    ("best", "method", "word"),
    [
        pytest.param(11.0, "quiet band", "model_inadequate", id="much is left"),
        pytest.param(2.0, "periods", "undetermined", id="a little is left"),
        pytest.param(1.3, "quiet band", "undetermined", id="a little more than the least noise"),
        pytest.param(1.0, "periods", "missing_effect", id="what repeats is explained"),
        pytest.param(1.0, "quiet band", "missing_effect", id="nothing but noise is left"),
    ],
)
def test_without_a_healthy_recording_little_is_claimed(best: float, method: str, word: str) -> None:
    found = unchecked(bench(16.0, method=method), naming(best))

    assert found.word == word
    assert ("[[healthy]]" in found.text) == (word != "missing_effect")


@pytest.mark.parametrize(
    ("base", "best", "word"),
    [
        pytest.param(1.03, 1.0, "undetermined", id="nothing above the floor"),
        pytest.param(1.15, 1.0, "missing_effect", id="a little, and all of it is explained"),
        pytest.param(1.15, 1.08, "undetermined", id="a little, and a part of it is explained"),
        pytest.param(1.5, 1.2, "missing_effect", id="more than a changed motion causes"),
    ],
)
def test_a_little_more_than_healthy_is_named_if_explained(
    base: float, best: float, word: str
) -> None:
    assert undetermined_if_little_and_unexplained(left(base), FLOOR, naming(best)).word == word


def test_a_model_that_was_checked_keeps_its_verdict() -> None:
    found = naming(2.0)

    assert unchecked(bench(16.0, healthy=True), found) is found
