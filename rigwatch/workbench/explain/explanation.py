"""What an explanation says: verdict, ranking with strengths, how often such verdicts were wrong."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.search import at_bound
from rigwatch.workbench.compare import Bench, Comparison, added_variances, comparison, unweighed
from rigwatch.workbench.experiment import Experiment, propose
from rigwatch.workbench.explain.adequacy import ends_of_range, uncalibrated
from rigwatch.workbench.explain.exchange import Exchange
from rigwatch.workbench.explain.remaining_error import remaining_share, shows_little_of_it
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.explain.verdict_calibration import (
    LATER_COUNTS,
    LEFT_EDGES,
    cases_seen,
    cases_seen_along,
    cases_seen_logged,
    later_probability_wrong,
    most_probably_wrong,
    probability_wrong_along,
    probability_wrong_logged,
)
from rigwatch.workbench.fit import Value, as_written, values
from rigwatch.workbench.ranking import (
    MATERIAL,
    Ranked,
    error_ratio,
    neutral_strength,
    vanishing_shape,
)
from rigwatch.workbench.study import FILE, Study, assumed_values

STRENGTH_TOLD = ("missing_effect", "undetermined")
"""Verdicts of whose best effect the strength has its full uncertainty; fitting it takes time."""

UNEXPLAINED = ("unknown_effect", "model_inadequate")
"""Verdicts that values of another machine may cause."""
ASSUMED = "{names}: taken from the model file; set this machine's under [start] in {file}"
NOT_NEUTRAL = "its interval is open, but {neutral:g} is refuted by the error without it"
"""Note on the strength of an accepted effect whose interval holds the neutral value."""


@dataclass(frozen=True)
class Row:
    """One effect of the ranking.

    Attributes:
        effect, port: names of the effect and its port.
        train_error, held_out_error: with the effect in the model, None if not fitted.
        p_value: corrected for the number of candidates.
        class_: effects indistinguishable from it on this recording, as "effect@port".
        parameters: the effect's own, by name.
        accepted: whether the held-out error falls by more than chance.
        reason: why it is accepted, refused or not fitted, in words.
    """

    effect: str
    port: str
    train_error: float | None
    held_out_error: float | None
    p_value: float
    class_: list[str]
    parameters: dict[str, Value]
    accepted: bool
    reason: str


@dataclass(frozen=True)
class Explanation:
    """Result of explaining a study.

    Attributes:
        verdict: nothing_missing, missing_effect, undetermined, unknown_effect or model_inadequate.
        text: the verdict in a sentence.
        comparison: the current model against the recordings.
        ranking: best first.
        rivals: effects of different physics that the recording cannot distinguish from the best.
        also: second missing effect, if two are missing at once.
        next_experiment: an excitation that separates the rivals; None if there are none, or if
            none is found.
        wrong_probability: probability that the verdict is wrong, calibrated on simulated cases;
            None if a later step is judged along the measured motion, or if too few cases were like
            it.
        like_this: number of simulated cases with a similar verdict, and how many were wrong.
        beside: the other effects of the set that the named effect was judged in; with them `add`
            accepts it if it is refused alone.
        error_unit: SI unit of the errors in `ranking`; `text` tells them in that of the
            comparison's `told_in`.
        wrong_at_most: upper bound of that probability, 95 %; None as above.
        unlike: why no simulated case is like this one, in words; empty if some are.
        altered: how the logs differ from faultless ones, in words; `like_this` counts such logs
            where `unlike` is empty.
        remains: share of the error's energy above the noise floor that the effect named leaves, so
            that more is missing; 0 if it, or the set that it was judged in, explains the error.
        exchange: an effect that describes the last accepted one better, if nothing beside it
            explains the error; None if none does, or if that was not asked.
        on_bound: names of the named effect's own parameters that are on a bound.
        tried_rarer: whether the library's rarer effects were tried in a second pass.
        together: parameters of effects that are missing at once, by "effect@port", from the fit
            with all of them; empty if one is missing. A row of `ranking` has those that an effect
            has alone, in which it stands for the others as well.
    """

    verdict: str
    text: str
    comparison: Comparison
    ranking: list[Row]
    rivals: list[str] = field(default_factory=list)
    also: list[str] = field(default_factory=list)
    next_experiment: Experiment | None = None
    wrong_probability: float | None = 0.5
    like_this: tuple[int, int] = (0, 0)
    beside: list[str] = field(default_factory=list)
    error_unit: str = ""
    exchange: Exchange | None = None
    wrong_at_most: float | None = None
    unlike: str = ""
    remains: float = 0.0
    altered: list[str] = field(default_factory=list)
    on_bound: list[str] = field(default_factory=list)
    tried_rarer: bool = False
    together: dict[str, dict[str, Value]] = field(default_factory=dict)


def explanation(
    bench: Bench, rows: list[Ranked], verdict: Verdict, fitted_in: Bench | None = None
) -> Explanation:
    """Converts a ranking and a verdict to the result shown to users and programs.

    Args:
        bench: the study.
        rows: its ranking.
        verdict: on it.
        fitted_in: the bench in which the effect named is fitted; None if it is the study's.
    """
    members = [*verdict.members, *verdict.rivals]
    more, told = _of_the_strength(fitted_in or bench, verdict)
    told += _assumed(bench.study) if verdict.word in UNEXPLAINED else []
    told += ends_of_range(bench)
    compared = comparison(bench)
    compared = replace(compared, remarks=[*compared.remarks, *told])
    fitted = {row.label: row for row in rows if row.fitted is not None}
    listed = [
        _row(row, members, more) if row is verdict.best else _row(row, _not_told_from(row, fitted))
        for row in rows
    ]
    remains = _remains(bench, verdict)
    unlike = "; ".join([
        *uncalibrated(bench), *_unlike_training(bench, verdict), *unlike_logged(bench, remains)
    ])  # fmt: skip
    probability, similar = _reliability(bench, verdict)
    most = None if unlike else most_probably_wrong(*similar)
    return Explanation(
        verdict.word,
        verdict.text,
        compared,
        listed,
        list(verdict.rivals),
        list(verdict.second),
        _experiment(bench, rows, verdict),
        None if unlike or most is None else probability,
        similar,
        list(verdict.beside),
        compared.unit,
        wrong_at_most=most,
        unlike=unlike,
        remains=remains,
        altered=list(bench.data.altered),
        on_bound=_on_bound(verdict),
        together=_together(fitted_in or bench, verdict),
    )


def _experiment(bench: Bench, rows: list[Ranked], verdict: Verdict) -> Experiment | None:
    """An excitation that separates the rivals; None without rivals, or if none is found."""
    # A rival of a set may have no row of its own among the single effects.
    others = [row for row in rows if row.label in verdict.rivals]
    # Excitations are compared by simulating the motion; a model along the measured motion cannot.
    if verdict.best is None or not others or bench.data.along_motion:
        return None
    return propose(bench, verdict.best, others)


def _of_the_strength(bench: Bench, verdict: Verdict) -> tuple[dict[str, float], list[str]]:
    """Variances that what is taken for known adds to the best effect's parameters, and remarks."""
    best = verdict.best if verdict.word in STRENGTH_TOLD else None
    if best is None or best.fitted is None:
        return {}, []
    more = added_variances(bench.study, bench.data, bench.bare, best.fitted)
    return more, list(unweighed(bench, best.placement, best.fitted, more))


def _together(bench: Bench, verdict: Verdict) -> dict[str, dict[str, Value]]:
    """Parameters of effects that are missing at once, by their labels; empty if one is."""
    best, fitted = verdict.best, verdict.together
    if best is None or fitted is None or verdict.word not in STRENGTH_TOLD:
        return {}
    more = added_variances(bench.study, bench.data, bench.bare, fitted)
    every = as_written(values(fitted.train, more), fitted.compiled.system)
    missing = fitted.placements[len(bench.base.placements) :]
    found = {each.label: each.own(every) for each in missing}
    # The text names another of the class than the set has: nothing is known of it in that set.
    return found if best.label in found else {}


def _assumed(study: Study) -> list[str]:
    """That values are the model file's, which may be of another machine."""
    names = assumed_values(study.model, study.file)
    return [ASSUMED.format(names=", ".join(names), file=study.folder / FILE)] if names else []


def _unlike_training(bench: Bench, verdict: Verdict) -> list[str]:
    """That the held-out recordings show less of what is missing than the training, in words."""
    best = verdict.best if verdict.word in STRENGTH_TOLD else None
    if best is None or best.fitted is None or verdict.beside or verdict.second:
        return []
    if bench.floor.reached(bench.base.held_out) and not best.accepted:
        return ["the training alone asks for the effect"]
    if not shows_little_of_it(bench.base, best, bench.floor):
        return []
    share = remaining_share(bench.base, best, bench.floor)
    return [f"the held-out recordings show less than the training, which keeps {share:.0%}"]


def unlike_logged(bench: Bench, remains: float) -> list[str]:
    """That an effect leaves more than on simulated logs with lost rows or uneven times, in words.

    They are counted by word alone, and what is named there leaves little.
    """
    counted = bench.data.altered and not (bench.data.along_motion or bench.study.file.effects)
    much = counted and remains > LEFT_EDGES[-1]
    return [f"{remains:.0%} of the error's energy remains"] if much else []


def _remains(bench: Bench, verdict: Verdict) -> float:
    """Share of the error's energy that the effect named leaves, 0 beside a set that explains it."""
    best = verdict.best if verdict.word in STRENGTH_TOLD else None
    if best is None or best.fitted is None or verdict.beside or verdict.second:
        return 0.0
    return remaining_share(bench.base, best, bench.floor)


def _on_bound(verdict: Verdict) -> list[str]:
    """Names of the named effect's own parameters that are on a bound."""
    best = verdict.best if verdict.word in STRENGTH_TOLD else None
    if best is None or best.fitted is None:
        return []
    touching = dict.fromkeys(at_bound(best.fitted.train))
    return list(best.placement.own(touching))


def _reliability(bench: Bench, verdict: Verdict) -> tuple[float | None, tuple[int, int]]:
    """Probability that the verdict is wrong, and how many similar cases were, of how many."""
    later, rough = bool(bench.study.file.effects), bench.study.model.rough
    if bench.data.along_motion and later:
        return None, (0, 0)
    if bench.data.along_motion:
        counted = cases_seen_along(verdict.word, rough=rough)
        return probability_wrong_along(verdict.word, rough=rough), counted
    if bench.data.altered and not later:
        return probability_wrong_logged(verdict.word), cases_seen_logged(verdict.word)
    if later:
        return later_probability_wrong(), LATER_COUNTS
    return verdict.probability_wrong, cases_seen(verdict.word, verdict.evidence)


def _not_told_from(row: Ranked, fitted: Mapping[str, Ranked]) -> list[str]:
    """Labels of effects like one to first order, but for those whose fit leaves more, or less."""
    if row.fitted is None:
        return row.alike
    return [each for each in row.alike if each not in fitted or _same_error(row, fitted[each])]


def _same_error(one: Ranked, other: Ranked) -> bool:
    return abs(error_ratio(one, other) - 1) <= MATERIAL


def _row(row: Ranked, alike: list[str], more: Mapping[str, float] | None = None) -> Row:
    found: dict[str, Value] = {}
    if row.fitted is not None:
        every = _with_open_strength(row, values(row.fitted.train, more))
        every = as_written(every, row.fitted.compiled.system)
        found = row.placement.own(every)
    others = [label for label in alike if label != row.label]
    return Row(
        row.effect,
        row.port,
        row.fitted.train_error if row.fitted else None,
        row.fitted.held_out_error if row.fitted else None,
        row.p_value,
        others,
        found,
        row.accepted,
        row.reason,
    )


def holds_neutral(placement: Placement, own: Mapping[str, Value]) -> bool:
    """Whether the interval of an effect's strength holds its neutral value; `own`: its values."""
    name = placement.effect.strength
    interval = own[name].interval if name in own else None
    neutral = placement.effect.parameters[name].neutral
    return interval is not None and interval[0] <= neutral <= interval[1]


def _with_open_strength(row: Ranked, found: dict[str, Value]) -> dict[str, Value]:
    """The values, with a note at the strength of an accepted effect if its interval is open.

    The slip force of a contact that hardly slips is such, of which the stiffness is determined, and
    the strength of a limit that is too hard to tell how hard it is.
    """
    assert row.fitted is not None
    effect, prefix = row.placement.effect, row.placement.prefix
    name, neutral = prefix + effect.strength, effect.parameters[effect.strength].neutral
    if not (row.accepted and holds_neutral(row.placement, row.placement.own(found))):
        return found
    if neutral_strength(row.fitted.train, row.placement) is not None:
        return found | {name: replace(found[name], note=NOT_NEUTRAL.format(neutral=neutral))}
    shape = [other for other in vanishing_shape(effect) if found[prefix + other].interval]
    note = f"determined only together with {', '.join(shape)}" if shape else found[name].note
    return found | {name: replace(found[name], note=note)}


def as_data(found: Explanation) -> dict[str, object]:
    """The result as plain data, as printed by `rigwatch explain --json`."""
    ranking = [
        {name.rstrip("_"): getattr(row, name) for name in row.__dataclass_fields__}
        for row in found.ranking
    ]
    whole = {name: getattr(found, name) for name in found.__dataclass_fields__}
    return whole | {"ranking": ranking}
