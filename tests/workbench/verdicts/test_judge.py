"""The verdict on rankings whose errors are put in by hand: what is named, and what with it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.search import Convergence
from rigwatch.workbench.data import RESAMPLED, NoiseFloor
from rigwatch.workbench.explain.contradicting import explaining_all, leaves_less_of_all
from rigwatch.workbench.explain.credibility import unless_resampled
from rigwatch.workbench.explain.explain import _leaves_less
from rigwatch.workbench.explain.indistinguishable import undistinguished
from rigwatch.workbench.explain.only_training import undetermined_if_training_asks
from rigwatch.workbench.explain.remaining_error import remaining_share
from rigwatch.workbench.explain.sets.combination import Combination
from rigwatch.workbench.explain.sets.several_effects import (
    _Member,
    _named_alone,
    _set_verdict,
    _with_alternatives,
    may_need_several,
    with_similar,
)
from rigwatch.workbench.explain.verdict import Verdict, judge, not_converged
from rigwatch.workbench.explain.verdict_calibration import CLEAR, probability_wrong
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.ranking.rank import _far_simpler
from rigwatch.workbench.ranking.ranked import UNFITTABLE

WINDOWS = 40
TURNS = np.where(np.arange(WINDOWS) % 2, 1.0, -1.0)
JITTER = 0.01
PERIODS = NoiseFloor(np.ones(1), "periods")
"""Errors up to 1.1 are noise."""
MOTION = NoiseFloor(np.ones(1), "healthy motion")
QUIET = NoiseFloor(np.ones(1), "quiet band")


def leaving(squares: np.ndarray, outputs: int = 1) -> Fitted:
    """A fit that leaves these mean squares in the windows held out."""
    residuals = np.sqrt(squares)[:, None, None] * np.ones((1, 4, 1))
    unused: Any = None
    known: dict[str, dict[str, Any]] = {"ports": {}, "quantities": {}}
    model = SimpleNamespace(
        driving=lambda: ("u",),
        outputs={str(k): SimpleNamespace(unit="N", shown="") for k in range(outputs)},
        **known,
    )
    compiled: Any = SimpleNamespace(system=SimpleNamespace(model=model))
    fit = Fit(compiled, unused, unused, unused, residuals, np.ones(1), unused, unused)
    return Fitted((), fit, fit, 1, 1)


def base(error: float = 3.0) -> Fitted:
    return leaving(np.full(WINDOWS, error**2))


def row(
    label: str,
    error: float = 1.0,
    behind: float = 0.0,
    *,
    cosines: dict[str, float] | None = None,
    alike: tuple[str, ...] = (),
    kind: str = "force",
    free: int = 1,
    family: str = "",
    refines: str = "",
    sampled: bool = False,
    gain: float | None = 1.0,
    accepted: bool = True,
    fitted: bool = True,
    jitter: float = JITTER,
    shift: bool = False,
    outputs: int = 1,
) -> Ranked:
    """An effect with a held-out error, worse than a steady one of it by standard deviations."""
    name, port = label.split("@")
    effect: Any = SimpleNamespace(
        free=free, family=family, refines=refines, sampled=sampled, time_shift=shift,
        confused_with=("radiation",),
    )  # fmt: skip
    found = Ranked(
        Placement(name, effect, port), kind, 0.0, 0.5, {}, list(alike), cosines or {}, {}
    )
    if fitted:
        worse = behind * JITTER / np.sqrt(WINDOWS - 1)
        found.fitted = leaving(error**2 + worse + jitter * TURNS, outputs)
        found.gain, found.accepted = gain, accepted
    return found


def best(label: str = "coulomb@load", error: float = 1.0, **more: Any) -> Ranked:
    """An effect whose error is the same in every window."""
    return row(label, error, jitter=0.0, **more)


# ---- where nothing helps ----------------------------------------------------------------------


def test_nothing_is_missing_where_the_error_is_noise() -> None:
    found = judge(base(1.1), [row("a@x", accepted=False)], PERIODS)
    text = "the held-out error is 1.10 times the noise floor, and no effect lowers it"
    assert found == Verdict("nothing_missing", None, (), (), text)


@pytest.mark.parametrize(
    ("after", "p_value", "along", "later", "word", "told"),
    [
        pytest.param(1.0, 1e-9, False, False, "undetermined", True, id="trains"),
        pytest.param(1.09, 1e-9, False, False, "nothing_missing", False, id="hardly trains"),
        pytest.param(1.0, 0.01, False, False, "nothing_missing", False, id="by chance"),
        pytest.param(1.0, 1e-9, True, False, "nothing_missing", True, id="along the motion"),
        pytest.param(1.0, 1e-9, False, True, "nothing_missing", True, id="at a later step"),
    ],
)
def test_what_only_the_training_asks_for_is_undetermined_where_nothing_held_out_is_missing(
    after: float, p_value: float, *, along: bool, later: bool, word: str, told: bool
) -> None:
    refused = row("leakage@tank", 1.1, accepted=False, alike=("offset@level",))
    assert refused.fitted is not None
    refused.fitted = replace(refused.fitted, train=base(after).train)
    refused.p_value = p_value
    bench: Any = SimpleNamespace(
        base=replace(base(1.1), placements=(refused.placement,) if later else ()),
        data=SimpleNamespace(along_motion=along, of_healthy=None),
        study=SimpleNamespace(model=SimpleNamespace(rough=False)),
    )
    held_out = judge(bench.base, [refused], PERIODS)
    assert held_out.word == "nothing_missing"
    found = undetermined_if_training_asks(bench, [refused], held_out)
    assert found.word == word
    named = ("leakage@tank", "offset@level") if word == "undetermined" else ()
    assert found.members == named
    asked = "but leakage@tank (or offset@level) lowers the error of the training from 1.1 to 1 N"
    assert (asked in found.text) == told


@pytest.mark.parametrize(
    ("error", "training", "word"),
    [
        pytest.param(1.15, 1.12, "nothing_missing", id="hardly trains"),
        pytest.param(1.15, 1.08, "missing_effect", id="trains"),
    ],
)
def test_at_the_noise_floor_the_training_error_must_fall_too(
    error: float, training: float, word: str
) -> None:
    named = best(error=error - 0.05)
    assert named.fitted is not None
    named.fitted = replace(named.fitted, train=base(training).train)
    assert judge(base(error), [named], QUIET).word == word
    assert named.accepted == (word == "missing_effect")


def test_what_may_be_it_and_cannot_be_fitted_is_not_passed_over_in_silence() -> None:
    failed = [row(label, fitted=False) for label in ("dahl@x", "lugre@x")]
    for each, why in zip(failed, ("too short", "diverged"), strict=True):
        each.likely, each.failure, each.p_value = True, why, len(why) * 1e-9
    found = judge(base(2.0), [*failed, row("a@x", 2.0, accepted=False)], PERIODS)
    assert found.word == "unknown_effect"
    assert "lugre@x and 1 more may be it, but cannot be fitted: diverged" in found.text


def test_what_no_effect_lowers_is_unknown() -> None:
    found = judge(base(2.0), [row("a@x", fitted=False)], PERIODS)
    text = "the held-out error is 2.00 times the noise floor, and no known effect lowers it"
    assert found == Verdict("unknown_effect", None, (), (), text)


def test_where_no_effect_suits_the_ports_that_is_said() -> None:
    found = judge(base(2.0), [], PERIODS)
    text = (
        "the held-out error is 2.00 times the noise floor, and no further known effect suits the"
        " model's ports"
    )
    assert found == Verdict("unknown_effect", None, (), (), text)


def test_what_coloured_noise_may_be_is_said() -> None:
    rows = [row("a@x", fitted=False), row("b@x", fitted=False)]
    for each, p_value in zip(rows, (0.3, 0.8), strict=True):
        each.p_value = p_value
    found = judge(base(2.0), rows, QUIET)
    assert found.word == "unknown_effect"
    assert "no more like an effect than coloured noise is (p = 0.3)" in found.text
    assert "coloured" not in judge(base(2.0), rows, PERIODS).text
    rows[1].p_value = 0.01
    assert "coloured" not in judge(base(2.0), rows, QUIET).text


@pytest.mark.parametrize(
    ("error", "p_value", "floor", "word"),
    [
        pytest.param(1.9, 0.4, QUIET, "nothing_missing", id="like noise"),
        pytest.param(2.1, 0.4, QUIET, "unknown_effect", id="too much for it"),
        pytest.param(1.9, 0.01, QUIET, "unknown_effect", id="like an effect"),
        pytest.param(1.9, 0.4, PERIODS, "unknown_effect", id="the noise is known"),
    ],
)
def test_after_an_effect_a_little_coloured_noise_is_not_told_as_something_missing(
    error: float, p_value: float, floor: NoiseFloor, word: str
) -> None:
    refused = row("a@x", fitted=False)
    refused.p_value = p_value
    later = replace(base(error), placements=(refused.placement,))
    found = judge(later, [refused], floor)
    assert found.word == word
    assert ("coloured noise" in found.text) == (floor is QUIET and p_value > 0.05)
    assert judge(base(error), [refused], floor).word == "unknown_effect"


def ended(converged: bool, undetermined: tuple[str, ...] = ()) -> Convergence:
    return Convergence(converged, 0.0, 1, 1, undetermined, (), "start", "stuck")


def test_a_verdict_is_not_built_on_a_fit_that_did_not_converge() -> None:
    found = not_converged({"one": None, "two": ended(True), "the base": ended(False)})
    text = "the fit of the base did not converge: stuck"
    assert found == Verdict("model_inadequate", None, (), (), text)
    found = not_converged({"it": ended(False, ("m", "c"))})
    assert found is not None
    assert found.text == ("the fit of it did not converge: stuck; the data do not determine m, c")
    assert not_converged({"one": None, "two": ended(True, ("m",))}) is None


# ---- one effect -------------------------------------------------------------------------------


def test_the_only_effect_that_helps_is_missing() -> None:
    only = best(error=1.05)
    found = judge(base(3.0), [only, row("b@x", accepted=False, cosines={})], PERIODS)
    assert (found.word, found.best, found.members) == ("missing_effect", only, ("coulomb@load",))
    assert (found.rivals, found.second) == ((), ())
    assert found.text == ("coulomb@load is missing: the held-out error falls from 3 to 1.05 N")
    assert found.evidence.left == pytest.approx((1.05**2 - 1) / (3**2 - 1))
    assert found.probability_wrong == probability_wrong("missing_effect", found.evidence)


def test_the_margin_is_to_the_nearest_that_it_is_not_confused_with() -> None:
    known = best(cosines={"same@load": 1.0})
    rows = [
        known,
        row("far@x", behind=9.0),
        row("near@x", behind=4.0, accepted=False),
        row("same@load", behind=1.0),
        row("unfitted@x", fitted=False),
    ]
    found = judge(base(), rows, PERIODS)
    assert found.members == ("coulomb@load", "same@load")
    assert found.evidence.margin == pytest.approx(4.0, rel=1e-6)
    alone = judge(base(), [known], PERIODS)
    assert alone.evidence.margin == CLEAR


def test_what_else_lowers_the_error_is_mentioned() -> None:
    found = judge(base(), [best(), row("b@x", behind=5.0), row("c@x", 1.02, 5.0)], PERIODS)
    assert found.word == "missing_effect"
    assert found.text.endswith("; also accepted: b@x (1), c@x (1.02)")


def test_an_effect_that_leaves_most_is_not_the_answer() -> None:
    found = judge(base(3.0), [best(error=2.0)], PERIODS)
    assert found.word == "unknown_effect"
    assert found.text == (
        "the best known effect, coulomb@load, leaves much of the error above the noise floor"
        "; 38% of the error's energy remains, 2 times the noise floor"
    )
    assert judge(base(3.0), [best(error=2.0)], QUIET).word == "missing_effect"
    assert remaining_share(base(3.0), best(error=2.0), QUIET) == pytest.approx(0.375)
    assert remaining_share(base(3.0), best(error=1.0), QUIET) == 0.0
    assert judge(base(3.0), [best(error=2.7)], QUIET).word == "unknown_effect"


def test_of_training_and_held_out_error_the_one_that_keeps_more_is_told() -> None:
    named = best(error=1.5)
    assert named.fitted is not None
    named.fitted = replace(named.fitted, train=base(2.0).train)
    assert remaining_share(base(), named, QUIET) == pytest.approx(0.375)
    said = judge(base(), [named], QUIET).text
    assert "; 38% of the training error's energy remains, 2 times the noise floor" in said


@pytest.mark.parametrize(("train", "told"), [(1.0, True), (2.9, False)])
def test_what_only_the_held_out_shows_is_told(train: float, *, told: bool) -> None:
    named = best(error=2.8)
    assert named.fitted is not None
    named.fitted = replace(named.fitted, train=base(train).train)
    said = judge(base(), [named], PERIODS).text
    assert ("exchange [[train]] and [[held_out]]" in said) == told
    nothing = replace(base(), train=base(train).train)
    said = judge(nothing, [row("a@x", accepted=False)], PERIODS).text
    assert ("the training is described down to its noise" in said) == told


@pytest.mark.parametrize(
    ("train", "like", "word"),
    [
        pytest.param(2.2, (), "undetermined", id="a third of the training remains"),
        pytest.param(1.05, (), "missing_effect", id="nothing of it"),
        pytest.param(2.2, ("b@x",), "undetermined", id="like it, but unlike held out"),
    ],
)
def test_what_explains_the_held_out_alone_gives_way_to_what_explains_more_of_all(
    train: float, like: tuple[str, ...], word: str
) -> None:
    """As a dead band of a pump beside outlets that follow another law than the model's."""
    only = trained(best(error=1.3, alike=like, cosines={"b@x": 0.97}), train)
    rival = trained(row("b@x", 2.2), 1.0)
    found = judge(replace(base(6.0), train=base(3.4).train), [only, rival], QUIET)
    assert found.word == word
    assert found.rivals == (("b@x",) if word == "undetermined" else ())


@pytest.mark.parametrize(("train", "several"), [(2.2, True), (1.05, False)])
def test_sets_are_tried_where_an_effect_leaves_much_of_the_training_alone(
    train: float, *, several: bool
) -> None:
    only = trained(best(error=1.3), train)
    before = replace(base(6.0), train=base(3.4).train)
    bench: Any = SimpleNamespace(base=before, floor=PERIODS, data=SimpleNamespace(of_healthy=None))
    verdict = Verdict("missing_effect", only, (only.label,), (), "")
    assert may_need_several(bench, verdict) is several


@pytest.mark.parametrize(
    ("held_out", "train", "word"),
    [(2.3, 2.3, "unknown_effect"), (2.3, 2.0, "missing_effect"), (2.0, 2.3, "missing_effect")],
)
def test_beside_an_accepted_effect_one_that_leaves_most_of_both_is_not_the_answer(
    held_out: float, train: float, word: str
) -> None:
    only = trained(best(error=held_out), train)
    assert judge(base(3.0), [only], QUIET).word == "missing_effect"
    later = replace(base(3.0), placements=(row("a@x").placement,))
    assert judge(later, [only], QUIET).word == word


def trained(found: Ranked, error: float) -> Ranked:
    """An effect with another error in training than held out."""
    assert found.fitted is not None
    found.fitted = replace(found.fitted, train=base(error).train)
    return found


@pytest.mark.parametrize(
    ("other", "left", "word"),
    [
        pytest.param({}, 1.6, "undetermined", id="explains more of all recordings"),
        pytest.param({"free": 2}, 1.6, "missing_effect", id="with more parameters"),
        pytest.param({"accepted": False}, 1.6, "missing_effect", id="refused"),
        pytest.param({"family": "drag"}, 1.6, "missing_effect", id="of one family"),
        pytest.param({}, 1.05, "missing_effect", id="where only noise remains"),
    ],
)
def test_an_effect_that_leads_on_the_recordings_held_out_alone_is_not_named(
    other: dict[str, Any], left: float, word: str
) -> None:
    only = trained(best(error=left, family="drag", cosines={"b@x": 0.3}), 2.1)
    rival = trained(row("b@x", left + 0.2, **other), 1.5)
    found = judge(replace(base(), train=base(2.9).train), [only, rival], QUIET)
    assert found.word == word
    assert ("b@x explains more of all recordings together" in found.text) == (
        word == "undetermined"
    )


@pytest.mark.parametrize(
    ("held_out", "training", "other", "word"),
    [
        pytest.param(2.4, 2.4, {"uneven": 5.0}, "undetermined", id="held out cannot tell"),
        pytest.param(2.4, 2.4, {"uneven": 0.0}, "missing_effect", id="held out can"),
        pytest.param(2.4, 2.55, {"uneven": 5.0}, "missing_effect", id="hardly more of training"),
        pytest.param(2.4, 2.4, {"uneven": 5.0, "free": 2}, "missing_effect", id="less simple"),
        pytest.param(1.6, 2.4, {"uneven": 2.5}, "missing_effect", id="little is left"),
        pytest.param(1.6, 2.5, {"uneven": 0.0, "accepted": True}, "undetermined", id="accepted"),
        pytest.param(1.2, 2.5, {"uneven": 0.0, "accepted": True}, "missing_effect", id="at noise"),
        pytest.param(1.6, 2.4, {"accepted": True, "free": 3}, "undetermined", id="richer"),
        pytest.param(
            1.6, 2.55, {"accepted": True, "free": 3}, "missing_effect", id="hardly richer"
        ),
        pytest.param(
            1.6,
            2.4,
            {"accepted": True, "free": 3, "refines": "coulomb"},
            "missing_effect",
            id="the same in more detail",
        ),
    ],
)
def test_an_effect_that_leaves_much_gives_way_to_one_that_the_training_favours(
    held_out: float, training: float, other: dict[str, Any], word: str
) -> None:
    only = trained(best(error=held_out, cosines={"b@x": 0.3}), 2.6)
    named = "b@load" if "refines" in other else "b@x"
    given = {name: other[name] for name in ("free", "refines") if name in other}
    rival = row(named, accepted=other.get("accepted", False), **given)
    error = (held_out + 0.4 * rival.accepted + 0.2) ** 2 + other.get("uneven", 0.0) * np.repeat(
        [1.0, -1.0, 1.0, -1.0], 10
    )
    rival.fitted = replace(leaving(error), train=base(training).train)
    found = judge(replace(base(), train=base(2.9).train), [only, rival], QUIET)
    assert found.word == word
    assert ("b@x" in found.rivals) == (word == "undetermined")


@pytest.mark.parametrize(
    ("training", "free", "named"),
    [
        pytest.param(2.0, 1, "b@x", id="leaves less of all"),
        pytest.param(2.6, 1, "coulomb@load", id="leaves more of all"),
        pytest.param(2.0, 2, "coulomb@load", id="no simpler"),
    ],
)
def test_a_parameter_more_that_pays_held_out_alone_is_not_named(
    training: float, free: int, named: str
) -> None:
    only = trained(best(error=1.5, family="drag", free=2), 2.4)
    simpler = trained(row("b@x", 1.6, family="drag", free=free), training)
    found = judge(replace(base(), train=base(2.9).train), [only, simpler], QUIET)
    assert found.word == "missing_effect"
    assert found.best is not None
    assert found.best.label == named


@pytest.mark.parametrize(
    ("left", "training", "explained", "word"),
    [
        pytest.param(1.6, 3.5, 0.6, "undetermined", id="resembles it more, and its fit failed"),
        pytest.param(1.6, 3.5, 0.4, "missing_effect", id="resembles it less"),
        pytest.param(1.6, 2.85, 0.6, "missing_effect", id="refused by its fit"),
        pytest.param(1.05, 3.5, 0.6, "missing_effect", id="nothing is left for it"),
    ],
)
def test_an_effect_whose_fit_failed_is_not_refuted_while_much_is_left(
    left: float, training: float, explained: float, word: str
) -> None:
    only = trained(best(error=left, cosines={"b@x": 0.3}), 1.8)
    failed = trained(row("b@x", 4.0, accepted=False), training)
    failed.explained = explained
    found = judge(replace(base(), train=base(2.9).train), [only, failed], QUIET)
    assert found.word == word
    assert found.rivals == (("b@x",) if word == "undetermined" else ())
    assert ("its fit ended in a local minimum" in found.text) is (word == "undetermined")


@pytest.mark.parametrize(("explained", "word"), [(0.6, "undetermined"), (0.4, "missing_effect")])
def test_an_effect_that_cannot_be_fitted_is_not_refuted_while_much_is_left(
    explained: float, word: str
) -> None:
    only = trained(best(error=1.6, cosines={"b@x": 0.3}), 1.8)
    failed = row("b@x", 4.0, accepted=False)
    failed.fitted, failed.reason, failed.explained = None, UNFITTABLE, explained
    assert judge(replace(base(), train=base(2.9).train), [only, failed], QUIET).word == word


def test_what_hardly_lowers_the_training_error_is_not_named_with_confidence() -> None:
    near, only = base(1.3), best(error=1.1)
    assert judge(near, [only], QUIET).word == "missing_effect"
    for row_, trained in ((only, 2.4), (best(error=1.1), 2.1)):
        assert row_.fitted is not None
        row_.fitted = replace(row_.fitted, train=base(trained).train)
        found = judge(replace(near, train=base(2.5).train), [row_], QUIET)
        assert found.word == ("unknown_effect" if trained == 2.4 else "missing_effect")


# ---- its own kind -----------------------------------------------------------------------------


def members(other: Ranked, known: Ranked | None = None) -> tuple[str, ...]:
    return judge(base(), [known or best(), other], PERIODS).members[1:]


def same(
    label: str = "stribeck@load", cosine: float = 1.0, label_of: str = "coulomb@load", **more: Any
) -> Ranked:
    return best(label_of, cosines={label: cosine}, **more)


@pytest.mark.parametrize(
    ("cosine", "behind", "joins"),
    [(0.9996, 1.9, True), (0.9996, 2.1, False), (0.9994, 0.0, False)],
)
def test_what_looks_the_same_and_does_as_well_is_of_its_class(
    cosine: float, behind: float, joins: bool
) -> None:
    other = row("stribeck@load", behind=behind)
    assert members(other, same(cosine=cosine)) == ("stribeck@load",) * joins


def test_what_was_not_fitted_is_of_its_class_only_if_it_is_the_same() -> None:
    other = row("stribeck@load", fitted=False, family="friction")
    assert members(other, same(cosine=0.9996)) == ("stribeck@load",)
    assert members(other, same(cosine=0.9994, family="friction")) == ()
    assert members(other) == ()


def test_a_family_says_the_same_in_other_words() -> None:
    other = row("stribeck@load", behind=1.9, family="friction")
    assert members(other, best(family="friction")) == ("stribeck@load",)
    assert members(other, best(family="backlash")) == ()
    assert members(row("stribeck@load", behind=1.9), best()) == ()


def test_what_failed_its_own_test_is_of_no_class() -> None:
    assert members(row("stribeck@load", accepted=False), same()) == ()


def test_a_refinement_needs_a_reason_of_its_own() -> None:
    assert members(row("stribeck@load", free=2), same()) == ()
    assert members(row("stribeck@load", refines="coulomb"), same()) == ()
    assert members(row("stribeck@load", refines="viscous"), same()) == ("stribeck@load",)
    alike = same(alike=("viscous@load",))
    assert members(row("stribeck@load", refines="viscous"), alike) == ()
    assert members(row("stribeck@load", free=1), same(free=2)) == ()


def test_a_refinement_of_what_is_in_the_class_is_not_named_beside_it() -> None:
    known = best("offset@drive", cosines={"force@load": 1.0, "by_direction@load": 1.0})
    simple, fine = row("force@load"), row("by_direction@load", refines="force")
    found = judge(base(), [known, simple, fine], PERIODS)
    assert found.members == ("offset@drive", "force@load")
    found = judge(base(), [known, row("force@load", behind=9.0), fine], PERIODS)
    assert found.members == ("offset@drive", "by_direction@load")
    other = row("by_direction@shaft", refines="force")
    known.cosines["by_direction@shaft"] = 1.0
    found = judge(base(), [known, simple, other], PERIODS)
    assert found.members == ("offset@drive", "force@load", "by_direction@shaft")
    of_the_best = row("by_rate@drive", refines="offset")
    known.cosines["by_rate@drive"] = 1.0
    assert judge(base(), [known, of_the_best], PERIODS).members == ("offset@drive",)


def test_an_effect_that_is_ahead_block_by_block_is_a_rival_of_the_one_that_is_named() -> None:
    """The named one has the smaller error by a hair, which an average over samples may give."""
    named = best("lag@acceleration_sensor", error=1.0306)
    ahead = row("lag@drive", 1.0306, behind=-3.0, cosines={named.label: 0.95})
    named.cosines[ahead.label] = 0.95

    assert undistinguished(named, [named, ahead], trusted=True)[1] == ("lag@drive",)


def test_errors_that_differ_by_where_the_fits_stopped_are_equal() -> None:
    for ratio, joins in ((1.00009, True), (1.00011, False)):
        other = row("stribeck@load", 1.05 * ratio, jitter=0.0)
        assert members(other, same(error=1.05)) == ("stribeck@load",) * joins


# ---- other physics ----------------------------------------------------------------------------


def rivals(other: Ranked, cosine: float, floor: NoiseFloor = PERIODS, **known: Any) -> bool:
    """Whether `other` is named as a rival of the best, with which it has this cosine."""
    first = best(cosines={other.label: cosine}, **known)
    found = judge(base(8.0), [first, other], floor)
    assert found.best is first
    if found.rivals:
        assert found.rivals == (other.label,)
        words = f"{first.label} and {other.label} explain this recording equally well"
        assert found.word == "undetermined"
        assert found.text.startswith(words)
    return bool(found.rivals)


@pytest.mark.parametrize(
    ("cosine", "behind", "accepted", "expected"),
    [
        (0.81, 1.9, True, True),
        (0.79, 1.9, True, False),
        (0.81, 2.1, True, False),
        (0.99, 2.1, True, False),
        (0.99, 0.0, False, False),
    ],
)
def test_similar_physics_that_does_as_well_is_a_rival(
    cosine: float, behind: float, accepted: bool, expected: bool
) -> None:
    other = row("lag@drive", behind=behind, accepted=accepted)
    assert rivals(other, cosine) == expected


@pytest.mark.parametrize(
    ("fitted", "cosine", "joins"),
    [(False, 0.9996, True), (False, 0.9994, False), (True, 0.9996, False)],
)
def test_what_was_not_fitted_is_a_rival_where_it_is_parallel_to_one(
    fitted: bool, cosine: float, joins: bool
) -> None:
    first = best(cosines={"lag@drive": 0.9})
    second = row("lag@drive")
    third = row("delay@drive", cosines={"lag@drive": cosine}, fitted=fitted, accepted=False)
    assert judge(base(8.0), [first, second, third], PERIODS).rivals == (
        ("lag@drive", "delay@drive") if joins else ("lag@drive",)
    )
    unknown = row("gap@x", fitted=False)
    assert judge(base(8.0), [first, second, unknown], PERIODS).rivals == ("lag@drive",)


@pytest.mark.parametrize(
    ("port", "cosine", "behind", "expected"),
    [
        ("load", 0.96, 0.0, True),
        ("load", 0.94, 0.0, False),
        ("load", 0.96, 0.5, False),
        ("drive", 0.96, 0.5, True),
        ("drive", 0.94, 0.5, False),
        ("drive", 0.96, 2.5, False),
        ("load", 0.81, -1.5, True),
        ("load", 0.79, -1.5, False),
        ("load", 0.81, -0.9, False),
    ],
)
def test_with_more_parameters_a_rival_must_do_no_worse(
    port: str, cosine: float, behind: float, expected: bool
) -> None:
    assert rivals(row(f"lag@{port}", behind=behind, free=2), cosine) == expected


@pytest.mark.parametrize(
    ("cosine", "error", "expected"),
    [(0.96, 2.99, True), (0.96, 3.01, False), (0.94, 2.5, False), (0.81, 2.0, True)],
)
def test_where_more_is_left_what_looks_alike_stays_a_rival(
    cosine: float, error: float, expected: bool
) -> None:
    assert rivals(row("lag@load", error), cosine, error=2.0) == expected


def test_where_more_is_left_further_parameters_are_no_argument() -> None:
    assert not rivals(row("lag@drive", 2.0, free=2), 0.99, error=2.0)
    assert not rivals(row("lag@load", 2.0, -1.5, free=2), 0.99, error=2.0)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, True),
        ({"kind": "force"}, False),
        ({"error": 3.01}, False),
        ({"gain": 0.79}, False),
        ({"gain": None}, False),
        ({"accepted": False}, False),
        ({"cosine": 0.79}, False),
    ],
)
def test_along_a_healthy_motion_a_late_drive_may_be_a_late_sensor(
    change: dict[str, Any], expected: bool
) -> None:
    given = {"kind": "sensor", "error": 2.9, "gain": 0.81, "cosine": 0.81, **change}
    cosine = given.pop("cosine")
    assert rivals(row("lag@x", **given), cosine, MOTION, error=2.0) == expected
    assert not rivals(row("lag@x", **given), cosine, PERIODS, error=2.0)


def test_a_late_drive_must_gain_nearly_as_much_and_look_similar() -> None:
    late = row("lag@x", 2.5, kind="sensor", gain=1.5)
    assert not rivals(late, 0.81, MOTION, error=2.0, gain=2.0)
    assert rivals(late, 0.81, MOTION, error=2.0, gain=1.8)
    assert judge(base(8.0), [best(error=2.0), late], MOTION).rivals == (), "it looks like nothing"


def test_all_rivals_are_named() -> None:
    first = best(cosines={"lag@x": 0.9, "gap@y": 0.9})
    found = judge(base(), [first, row("lag@x"), row("gap@y")], PERIODS)
    assert found.rivals == ("lag@x", "gap@y")
    assert found.text == "coulomb@load and lag@x, gap@y explain this recording equally well"


def test_a_rival_is_named_once() -> None:
    other = row("lag@x", 2.0, kind="sensor")
    first = best(error=2.0, cosines={"lag@x": 0.99})
    assert judge(base(8.0), [first, other], MOTION).rivals == ("lag@x",)


def test_what_explains_the_rest_too_little_is_unknown_whatever_its_rivals() -> None:
    first, other = best(error=2.5, cosines={"lag@x": 0.99}), row("lag@x", 2.5)
    assert judge(base(3.0), [first, other], PERIODS).word == "unknown_effect"


# ---- which of equals --------------------------------------------------------------------------


def name_of(*rows: Ranked, error: float = 3.0, floor: NoiseFloor = PERIODS) -> str:
    found = judge(base(error), rows, floor).best
    assert found is not None
    return found.label


def test_the_smallest_error_is_named_where_it_is_clearly_smaller() -> None:
    assert name_of(row("a@x", behind=3.0), best("b@x", free=3)) == "b@x"
    assert name_of(best("b@x", free=3), row("a@x", behind=3.0)) == "b@x"


def test_of_equals_the_one_with_fewest_parameters_is_named() -> None:
    assert name_of(best("b@x", free=3), row("a@x", behind=1.9, free=2)) == "a@x"


def test_of_equals_a_computers_effect_is_named_last() -> None:
    sampled = best("hold@x", sampled=True)
    assert name_of(sampled, row("a@x", behind=1.0)) == "a@x"
    assert name_of(sampled, row("a@x", behind=1.0, free=2)) == "hold@x"


def test_of_equals_with_as_many_parameters_the_better_is_named() -> None:
    assert name_of(row("a@x", behind=1.0), best("b@x")) == "b@x"


@pytest.mark.parametrize(
    ("level", "ratio", "named"),
    [(2.0, 1.009, "a@x"), (2.0, 1.011, "b@x"), (1.05, 1.009, "b@x")],
)
def test_while_more_is_missing_a_little_less_is_no_reason_for_a_parameter(
    level: float, ratio: float, named: str
) -> None:
    rows = best("b@x", error=level, free=2), row("a@x", level * ratio, jitter=0.001)
    assert name_of(*rows) == named


@pytest.mark.parametrize(("ratio", "named"), [(1.025, "dahl@x"), (1.04, "lugre@x")])
def test_a_refinement_of_one_family_must_gain_as_much_as_an_effect(
    ratio: float, named: str
) -> None:
    richer = best("lugre@x", error=2.0, free=3, family="friction")
    simpler = row("dahl@x", 2.0 * ratio, jitter=0.001, free=2, family="friction")
    assert name_of(richer, simpler) == named
    other = row("dahl@x", 2.0 * ratio, jitter=0.001, free=2, family="drag")
    assert name_of(richer, other) == "lugre@x"


def test_a_little_less_is_a_reason_between_effects_of_as_many_parameters() -> None:
    assert name_of(row("a@x", 2.01, jitter=0.001), best("b@x", error=2.0)) == "b@x"


def orders(level: float, share: float | None, lower: float = 1.2) -> tuple[Ranked, Ranked]:
    """An effect of higher order, and the one that it refines with a share of its gain."""
    cubic = best("cubic@x", error=level, refines="spring", gain=1.0)
    return cubic, row("spring@x", level * lower, gain=share)


@pytest.mark.parametrize(
    ("level", "share", "named"),
    [
        (2.0, 0.76, "spring@x"),
        (2.0, 0.74, "cubic@x"),
        (2.0, None, "cubic@x"),
        (1.05, 0.99, "cubic@x"),
    ],
)
def test_while_more_is_missing_the_lower_order_goes_first(
    level: float, share: float | None, named: str
) -> None:
    assert name_of(*orders(level, share)) == named


def test_the_higher_order_is_named_where_it_alone_explains_the_error() -> None:
    assert name_of(*orders(2.0, 0.9), error=12.0) == "spring@x", "both explain it"
    assert name_of(*orders(2.0, 0.9, lower=1.5), error=9.0) == "cubic@x", "it alone does"
    assert name_of(*orders(2.0, 0.9, lower=1.5), error=5.0) == "spring@x", "neither does"


def test_a_higher_order_without_a_lower_one_is_named() -> None:
    cubic = best("cubic@x", error=2.0, refines="spring")
    assert name_of(cubic, row("gap@x", 2.4, gain=0.99)) == "cubic@x"
    unaccepted = row("spring@x", 2.4, gain=0.99, accepted=False)
    assert name_of(cubic, unaccepted) == "cubic@x"


@pytest.mark.parametrize(
    ("level", "floor", "spring", "named"),
    [
        pytest.param(2.0, MOTION, {"gain": 0.985}, "spring@x", id="nearly all"),
        pytest.param(2.0, MOTION, {"gain": 0.975}, "slip@x", id="less"),
        pytest.param(2.0, MOTION, {"gain": 0.985, "free": 3}, "slip@x", id="hardly simpler"),
        pytest.param(2.0, MOTION, {"gain": 0.985, "port": "y"}, "slip@x", id="elsewhere"),
        pytest.param(1.0, MOTION, {"gain": 0.985}, "slip@x", id="only noise is left"),
        pytest.param(2.0, PERIODS, {"gain": 0.985}, "slip@x", id="the noise is known"),
    ],
)
def test_a_contact_that_hardly_slips_is_named_as_the_spring_that_it_is(
    level: float, floor: NoiseFloor, spring: dict[str, Any], named: str
) -> None:
    label = f"spring@{spring.pop('port', 'x')}"
    slip = best("slip@x", error=level, free=4, gain=1.0)
    assert name_of(slip, row(label, level * 1.2, **spring), error=9.0, floor=floor) == named


def test_a_far_simpler_law_is_fitted_before_a_loop_of_any_shape_is_named() -> None:
    loop = best("loop@x", free=4)
    others = [
        row(label, free=free, fitted=False)
        for label, free in (("slip@x", 2), ("finer@x", 3), ("slip@y", 2))
    ]
    weak = row("weak@x", fitted=False)
    for each in (*others, weak):
        each.likely, each.explained = True, 0.2 if each is weak else 0.5
    assert [each.label for each in _far_simpler([loop, *others, weak])] == ["slip@x"]
    assert _far_simpler(others) == []


@pytest.mark.parametrize(("outputs", "told_apart"), [(1, False), (2, True)])
def test_a_late_input_is_a_late_output_where_there_is_one_of_each(
    outputs: int, *, told_apart: bool
) -> None:
    sensor = best(
        "delay@sensor", kind="sensor", shift=True, outputs=outputs, cosines={"delay@drive": 0.9}
    )
    drive = row("delay@drive", 1.5, kind="actuator", shift=True, cosines={"delay@sensor": 0.9})
    found = judge(base(), [sensor, drive], PERIODS)
    assert found.word == "missing_effect"
    assert ("delay@drive" in found.members) is not told_apart


@pytest.mark.parametrize(
    ("cosine", "error", "told_apart"),
    [
        pytest.param(0.9999, 1.005, False, id="a trace less"),
        pytest.param(0.99, 1.005, True, id="the other input moves"),
        pytest.param(0.9999, 1.05, True, id="clearly less"),
    ],
)
def test_beside_an_input_that_hardly_moves_a_late_input_is_a_late_output(
    cosine: float, error: float, *, told_apart: bool
) -> None:
    sensor = best("delay@sensor", kind="sensor", shift=True, cosines={"delay@drive": cosine})
    drive = row(
        "delay@drive", error, kind="actuator", shift=True, jitter=0.0,
        cosines={"delay@sensor": cosine},
    )  # fmt: skip
    assert sensor.fitted is not None
    sensor.fitted.compiled.system.model.driving = lambda: ("power", "room")
    found = judge(base(), [sensor, drive], PERIODS)
    assert found.word == "missing_effect"
    assert ("delay@drive" in found.members) is not told_apart


@pytest.mark.parametrize(
    ("error", "told"),
    [
        pytest.param(1.0, True, id="equal"),
        pytest.param(None, True, id="parallel, not fitted"),
        pytest.param(1.02, False, id="told apart"),
    ],
)
def test_what_a_recording_cannot_tell_from_the_effect_named_stands_in_the_sentence(
    error: float | None, *, told: bool
) -> None:
    other = row("offset@x", error or 1.0, kind="sensor", fitted=error is not None)
    found = judge(base(), [same("offset@x", label_of="constant_force@load"), other], PERIODS)
    assert found.word == "missing_effect"
    both = "constant_force@load (or offset@x: this recording cannot tell them apart) is missing"
    assert (both in found.text) is told


def test_where_training_and_held_out_disagree_nothing_is_named_alone() -> None:
    best, other = row("valve_hysteresis@drive", 2.0), row("stribeck@shaft", 2.8, accepted=False)
    _with_training_error(best, 2.6)
    _with_training_error(other, 1.5)
    found = judge(base(), [best, other], QUIET)
    assert (found.word, found.rivals) == ("undetermined", ("stribeck@shaft",))
    _with_training_error(other, 2.6)
    assert judge(base(), [best, other], QUIET).word == "missing_effect"


@pytest.mark.parametrize(
    ("more", "told"),
    [
        pytest.param({}, True, id="of other physics"),
        pytest.param({"refines": "sag"}, False, id="a refinement"),
        pytest.param({"family": "drive"}, False, id="of one family"),
        pytest.param({"free": 1}, False, id="as simple"),
    ],
)
def test_what_leads_with_more_parameters_is_a_rival_where_rivals_are_told(
    more: dict[str, Any], told: bool
) -> None:
    # An error that differs from block to block leaves the two equal held out.
    simple = trained(row("sag@drive", 2.0, jitter=3.0, family="drive"), 2.6)
    leader = trained(row("limit@drive", 1.9, jitter=-3.0, **{"free": 2, **more}), 2.5)
    other = trained(row("rate@drive", 2.8, accepted=False), 1.5)
    found = judge(base(), [simple, leader, other], QUIET)
    assert found.word == "undetermined"
    assert ("limit@drive" in found.rivals) == told
    assert ("of those as simple (limit@drive lowers it further)" in found.text) == told


@pytest.mark.parametrize(
    ("held_out", "train", "left", "word"),
    [
        pytest.param(1.99, 1.3, 2.0, "undetermined", id="leads on both"),
        pytest.param(2.01, 1.3, 2.0, "missing_effect", id="leads on the training alone"),
        pytest.param(1.99, 1.8, 2.0, "missing_effect", id="explains hardly more of the training"),
        pytest.param(1.99, 1.0, 1.4, "missing_effect", id="little of the training is left"),
    ],
)
def test_what_leads_on_all_recordings_is_not_passed_over_for_its_parameters_where_much_is_left(
    held_out: float, train: float, left: float, word: str
) -> None:
    simple = trained(best("rate@drive", 2.0), left)
    leader = trained(row("limit@drive", held_out, free=2), train)
    found = judge(base(3.0), [simple, leader], QUIET)
    assert found.word == word
    assert found.best is simple
    if word == "undetermined":
        assert found.rivals == ("limit@drive",)
        assert found.text.startswith("rate@drive lowers the held-out error most of those as simple")


def _with_training_error(of: Ranked, error: float) -> None:
    assert of.fitted is not None
    of.fitted = replace(of.fitted, train=base(error).train)


@pytest.mark.parametrize(
    ("label", "error", "accepted", "word"),
    [
        pytest.param("radiation@x", 1.3, True, "undetermined", id="nearly as good"),
        pytest.param("radiation@x", 1.6, True, "missing_effect", id="much worse"),
        pytest.param("radiation@x", 1.3, False, "missing_effect", id="refused"),
        pytest.param("radiation@y", 1.3, True, "missing_effect", id="elsewhere"),
        pytest.param("leakage@x", 1.3, True, "missing_effect", id="of another kind"),
    ],
)
def test_what_a_set_bends_into_a_similar_law_is_not_named_alone(
    label: str, error: float, accepted: bool, word: str
) -> None:
    rows = [best("convection@x"), row(label, error, accepted=accepted)]
    named = Verdict("missing_effect", rows[0], ("convection@x",), (), "convection@x is missing")
    found = with_similar(named, rows)
    assert found.word == word
    assert found.rivals == ((label,) if word == "undetermined" else ())


@pytest.mark.parametrize("instead", ["radiation@x", "convection@x"])
def test_an_effect_that_equally_good_sets_replace_is_not_said_to_be_missing(instead: str) -> None:
    convection, delay = best("convection@x"), row("delay@x", 1.2)
    named = Verdict("missing_effect", convection, ("convection@x",), (), "convection@x is missing")
    other = Combination((row(instead, 1.0), delay))
    found = _with_alternatives(
        _Member(convection, named), Combination((convection, delay)), [other]
    ).verdict
    if instead == "convection@x":
        assert found is named
    else:
        assert (found.word, found.rivals) == ("undetermined", (instead,))
        assert found.text == "convection@x and radiation@x explain it equally well"


@pytest.mark.parametrize(
    ("after", "p_value", "verdict", "asked"),
    [
        pytest.param(1.3, 1e-9, "unknown_effect", True, id="most of the training"),
        pytest.param(2.8, 1e-9, "unknown_effect", False, id="little of it"),
        pytest.param(1.3, 0.01, "unknown_effect", False, id="by chance"),
        pytest.param(1.3, 1e-9, "missing_effect", False, id="another is named"),
    ],
)
def test_a_rarer_effect_that_the_training_asks_for_is_tried_beside_others(
    after: float, p_value: float, verdict: str, *, asked: bool
) -> None:
    """As a drift that what is held out shows only beside a dead band."""
    rarer = row("gain_drift@fan", 2.9, accepted=False)
    assert rarer.fitted is not None
    rarer.fitted = replace(rarer.fitted, train=base(after).train)
    rarer.p_value = p_value
    first: Any = SimpleNamespace(
        explanation=SimpleNamespace(verdict=verdict),
        bench=SimpleNamespace(base=base(), floor=PERIODS),
        rows=[row("offset@fan", 2.5)],
    )
    assert _leaves_less(first, rarer) == asked


@pytest.mark.parametrize(
    ("third", "word"),
    [
        pytest.param("viscous@pitching", "undetermined", id="at one port"),
        pytest.param("delay@command", "missing_effect", id="at two"),
    ],
)
def test_three_laws_at_one_port_stand_for_any_other(third: str, word: str) -> None:
    """As stiffnesses beyond places of their own do for a stall with hysteresis."""
    each = (best("cubic_stiffness@pitching"), row("hard_stop@pitching"), row(third))
    bench: Any = SimpleNamespace(base=base(), floor=PERIODS, data=SimpleNamespace(of_healthy=None))
    parts = [
        _Member(one, Verdict("missing_effect", one, (one.label,), (), f"{one.label} is missing"))
        for one in each
    ]
    found = _set_verdict(bench, each, parts[0].verdict, Combination(each), parts)
    assert found.word == word
    assert ("may be missing there" in found.text) == (word == "undetermined")


def test_of_a_class_the_effect_that_the_sentence_names_is_the_one_to_add() -> None:
    smoothing, lag = row("digital_smoothing@probe", 1.0), row("lag@heater", 1.0)
    named = Verdict("missing_effect", lag, ("lag@heater", smoothing.label), (), "")
    alone = {each.label: each for each in (smoothing, lag)}
    assert _named_alone(_Member(smoothing, named), alone) is lag
    del alone[lag.label]
    assert _named_alone(_Member(smoothing, named), alone) is smoothing


@pytest.mark.parametrize(
    ("left", "altered", "hold", "word"),
    [
        pytest.param(2.7, (RESAMPLED,), "zero", "undetermined", id="most is left"),
        pytest.param(2.0, (RESAMPLED,), "zero", "missing_effect", id="less is left"),
        pytest.param(2.7, (), "zero", "missing_effect", id="at its own rate"),
        pytest.param(2.7, (RESAMPLED,), "linear", "missing_effect", id="no held input"),
    ],
)
def test_resampling_a_held_input_may_look_like_a_small_effect(
    left: float, altered: tuple[str, ...], hold: str, word: str
) -> None:
    named = best("supply_sag@drive")
    _with_training_error(named, left)
    model = SimpleNamespace(inputs=("goal",), held=lambda _: hold)
    bench: Any = SimpleNamespace(
        study=SimpleNamespace(model=model), data=SimpleNamespace(altered=altered),
        base=base(3.0), floor=QUIET,
    )  # fmt: skip
    found = unless_resampled(bench, Verdict("missing_effect", named, (), (), "it is missing"))
    assert found.word == word
    assert ("log all recordings at one rate" in found.text) == (word == "undetermined")


# ---- the model's own error --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "floor", "rivals"),
    [
        (1.03, MOTION, ("leakage@between",)),
        (1.04, MOTION, ("leakage@between",)),
        (1.06, MOTION, ()),
        (1.03, PERIODS, ()),
    ],
    ids=["near", "at its limit", "above the floor", "noise alone"],
)
def test_of_two_effects_that_leave_nothing_the_models_own_error_may_favour_one(
    error: float, floor: NoiseFloor, rivals: tuple[str, ...]
) -> None:
    gain = best("gain@drive", 0.99, cosines={"leakage@between": 0.9})

    found = judge(base(1.4), [gain, row("leakage@between", error, behind=9.0)], floor)

    assert found.rivals == rivals
    assert found.word == ("undetermined" if rivals else "missing_effect")


def test_an_effect_far_better_within_the_models_own_error_has_no_rival() -> None:
    lag = best("lag@sensor", 0.7, cosines={"gain@drive": 0.9})

    assert judge(base(3.0), [lag, row("gain@drive", 0.99, behind=9.0)], MOTION).rivals == ()


# ---- where samples tell the states of an effect, and do not count for it -----------------------


def beginning_badly(found: Ranked, error: float = np.nan) -> Ranked:
    """The row with another error in the first four windows, which may not count for it."""
    assert found.fitted is not None
    residuals = found.fitted.held_out.residuals.copy()
    residuals[:4] = error
    fit = replace(found.fitted.held_out, residuals=residuals)
    found.fitted = replace(found.fitted, train=fit, held_out=fit)
    return found


def test_an_effect_is_not_named_for_the_samples_that_do_not_count_for_it() -> None:
    better = beginning_badly(row("coulomb@load", 1.0), 10.0)
    worse = beginning_badly(row("dahl@other", 1.3))
    assert worse.held_out_error < better.held_out_error
    for rows in ([better, worse], [worse, better]):
        found = judge(base(), rows, PERIODS)
        assert found.best is better
        assert "dahl@other" not in found.rivals


def test_nor_is_it_a_rival_for_them() -> None:
    named = beginning_badly(best(error=2.0), 2.5)
    other, less = beginning_badly(row("dahl@other", 2.1)), beginning_badly(row("lag@other", 1.9))
    assert not explaining_all(base(), named, (), [named, other], PERIODS)
    assert named.fitted is not None
    for each, leaves_less in ((other, False), (less, True)):
        assert each.fitted is not None
        assert leaves_less_of_all(each.fitted, named.fitted) is leaves_less
