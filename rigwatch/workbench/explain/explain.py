"""Ranks the effects that may be missing, gives a verdict and proposes the next experiment."""

from dataclasses import dataclass, replace

from msgspec import structs

from rigwatch.workbench.compare import (
    Bench,
    Decided,
    fitted_beside_healthy,
    may_share,
    open_bench,
    refuse_what_spoils,
    shared_bench,
    with_base,
    with_hold_decided,
)
from rigwatch.workbench.explain.adequacy import (
    cannot_tell,
    closer_base,
    inadequate,
    reversed_channel,
    stopped_by_outliers,
    unchecked,
    unexcited,
    with_adequate_base,
    with_base_offered,
    with_change_told,
    with_failure_told,
    with_reversed_port,
    with_unjudged_told,
)
from rigwatch.workbench.explain.changed_parameters import undetermined_if_parameters_changed
from rigwatch.workbench.explain.credibility import (
    credible_verdict,
    unless_refused,
    unless_resampled,
)
from rigwatch.workbench.explain.exchange import Exchange, exchange
from rigwatch.workbench.explain.explanation import (
    STRENGTH_TOLD,
    Explanation,
    explanation,
    holds_neutral,
)
from rigwatch.workbench.explain.lower_floor import with_lower_floor
from rigwatch.workbench.explain.motion_sensor import with_motion_sensor
from rigwatch.workbench.explain.only_training import SHOWN, undetermined_if_training_asks
from rigwatch.workbench.explain.rough_verdict import (
    MUCH,
    leaves_much,
    leaves_some,
    limited_verdict,
    much_left,
    undetermined_if_little_and_unexplained,
    undetermined_if_much_left,
)
from rigwatch.workbench.explain.sets.like_ports import with_like_ports
from rigwatch.workbench.explain.sets.pairs import two_effects
from rigwatch.workbench.explain.sets.rarer_rivals import tries_rarer, with_rarer_rivals
from rigwatch.workbench.explain.sets.several_effects import may_need_several, several_effects
from rigwatch.workbench.explain.verdict import Verdict, not_converged
from rigwatch.workbench.fit import begun_from_larger
from rigwatch.workbench.ranking import (
    MATERIAL,
    Progress,
    Ranked,
    in_order,
    leaves_only_noise,
    no_progress,
    own_floor,
    rank,
    rank_all,
    suitable,
    with_refinements,
)
from rigwatch.workbench.study import Refusals, Study, refusals, told

RARER = "{text}; it was found among {count} rarer effects, as no usual one explains the error"
BESIDE = "{text}; {count} rarer effects were tried, as {what} leaves much by itself"
OPEN = ("undetermined", "unknown_effect", "model_inadequate")
"""Verdicts that name no effect, and do not say that none is missing."""
BY_CHANCE = 0.05
"""Probability below which a rarer effect's score is more than chance."""
HALF = 0.5
"""Share of an effect's error above noise that a rarer one in its place may leave."""
OPEN_STRENGTH = "but the interval of {name} of {label} holds {neutral:g}"
BY_ITSELF = "with the training alone {label} leads, and both leave far more than noise"
BASE_NOT_CONVERGED = "{why}, but with the effect only noise is left"
SECOND_PASS = "the effect was found in a second pass"
TWO_BEYOND_BASE = "two effects at once on a base that was searched for are not told from others"


@dataclass(frozen=True, eq=False)
class Explained:
    """An explanation, and what it is based on.

    Attributes:
        bench: the study with the base that it was judged on.
        rows: the ranking.
        explanation: what is told of it.
        sought: whether what fits better in place of the last accepted effect was sought.
        offer: that effect; None if there is none.
    """

    bench: Bench
    rows: list[Ranked]
    explanation: Explanation
    sought: bool = False
    offer: Exchange | None = None


def explain(study: Study, progress: Progress = no_progress) -> Explanation:
    """Rank every effect at every port and judge.

    Args:
        study: the study.
        progress: called with a line of text as each part begins.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    progress("fitting the current model")
    return explained(open_bench(study), progress).explanation


def explained(bench: Bench, progress: Progress = no_progress) -> Explained:
    """`explain` of a study that has been fitted.

    Args:
        bench: the study, its recordings and the fitted model.
        progress: called with a line of text as each part begins.
    """
    adequate = with_adequate_base(bench, progress)
    first = _beside_healthy(_explained_once(adequate, progress), progress)
    if adequate is bench:
        first = _on_closer_base(first, progress)
    return _with_rarer(first, progress)


def _beside_healthy(first: Explained, progress: Progress) -> Explained:
    """The explanation; with the healthy recording in the training if that names more.

    The comparison remains that of the study's own training.
    """
    asked = first.explanation.verdict in {"undetermined", "unknown_effect"}
    study, data = first.bench.study, first.bench.data
    if not asked or study.file.effects or not may_share(study, data):
        return first
    progress("fitting what the healthy recording leaves open to it and the training together")
    bench = shared_bench(first.bench)
    if bench is None:
        return first
    rows = rank(bench.study, bench.data, bench.base, bench.floor, progress)
    refuse_what_spoils(bench, rows)
    second = _explained_once(bench, progress, rows)
    if not _names_more(first.explanation, second.explanation):
        return first
    own, found = first.explanation.comparison, unless_two(second.explanation)
    if (before := _another_before(first, second)) and found.verdict == "missing_effect":
        text = f"{found.text}; {BY_ITSELF.format(label=before)}"
        found = _unsure(replace(found, text=text, rivals=[*found.rivals, before]))
    compared = replace(own, remarks=found.comparison.remarks)
    return replace(second, bench=first.bench, explanation=replace(found, comparison=compared))


def _another_before(first: Explained, second: Explained) -> str:
    """Label of another effect that led before, if what is named now leaves far more than noise.

    Parameters that are free of the healthy recording may favour either law then, as of dry friction
    one that grows with pressure.
    """
    led, named = first.rows[0], second.rows[0]
    if not led.accepted or named.fitted is None:
        return ""
    told = second.explanation.ranking[0]
    same = led.label in {named.label, *told.class_, *second.explanation.rivals}
    much = second.bench.floor.ratio(named.fitted.held_out, named.fitted.calm) > MUCH
    return led.label if much and not same else ""


def _names_more(first: Explanation, second: Explanation) -> bool:
    """Whether a second look names an effect, or two at once where the first knows none."""
    two = first.verdict == "unknown_effect" and bool(second.also)
    return second.verdict == "missing_effect" or two


def _on_closer_base(first: Explained, progress: Progress) -> Explained:
    """The explanation; on a base closer to the healthy rig if only there it comes to an end."""
    if first.explanation.verdict not in OPEN:
        return first
    closer = closer_base(first.bench, progress)
    if closer is None:
        return first
    second = _explained_once(closer, progress)
    if second.explanation.verdict in OPEN:
        return first
    return replace(second, explanation=unless_two(second.explanation))


def unless_two(found: Explanation) -> Explanation:
    """What is named on a base that was searched for; two effects at once are undetermined there.

    Among pairs on many bases one is found that leaves nothing of a change that is neither, as of a
    lower supply.
    """
    if not found.also:
        return found
    return _unsure(replace(found, text=f"{found.text}; {TWO_BEYOND_BASE}"))


def _unless_open(found: Explanation, verdict: Verdict) -> Explanation:
    """What is named with several effects; undetermined if one of them may have no strength.

    Of a supply that sags, a friction whose interval holds zero takes what a sensor's gain leaves.
    """
    if found.verdict != "missing_effect" or not found.together or verdict.together is None:
        return found
    for placement in verdict.together.placements:
        label, effect = placement.label, placement.effect
        if holds_neutral(placement, found.together.get(label, {})):
            neutral = effect.parameters[effect.strength].neutral
            told = OPEN_STRENGTH.format(label=label, name=effect.strength, neutral=neutral)
            return _unsure(replace(found, text=f"{found.text}; {told}"))
    return found


def _unsure(found: Explanation) -> Explanation:
    """What is named, without confidence."""
    return replace(
        found,
        verdict="undetermined",
        text=f"likely, not certain: {found.text}",
        wrong_probability=None,
        wrong_at_most=None,
    )


def _with_rarer(first: Explained, progress: Progress) -> Explained:
    """The explanation; by the whole library if no usual effect explains the error.

    An effect that is named although it leaves much may be the likeness of a rarer one, as friction
    is of friction behind a gap. What is found has to leave nothing and, in place of an effect that
    is named, half its error above noise at most. What leaves something, but clearly less than the
    effect that is named, or as much, is told without confidence. Effects are fitted again only if
    the score of a rarer one, corrected for the number of all, is more than chance. Where nothing
    held out is missing, the training must certainly ask for it. Where a healthy recording checks a
    model along its measured motion, rarer ones are tried as refinements already, and fits take
    long.
    """
    bench, told = first.bench, first.explanation
    rarer = suitable(bench.study)[1]
    by_training = _only_training_may_ask(first)
    asked = told.exchange is None and (_asks_for_rarer(first) or by_training)
    tries = tries_rarer(bench.study, along_motion=bench.data.along_motion)
    if not (asked and rarer and tries):
        return first
    wider = with_whole_library(bench.study)
    rows = rank_all(wider, bench.data, bench.base)
    least = SHOWN if by_training else BY_CHANCE
    if not any(row.effect in rarer and row.p_value < least for row in rows):
        return _with_rarer_tried(first, f"nor is it like one of {len(rarer)} rarer ones")
    progress(f"no usual effect explains the error: trying {len(rarer)} rarer ones")
    rows = rank(wider, bench.data, bench.base, bench.floor, progress, known=first.rows)
    none = f"nor does one of {len(rarer)} rarer ones"
    leads = _trains_better if by_training else _leaves_less
    if not any(row.effect in rarer and leads(first, row) for row in rows):
        return _with_rarer_tried(first, none)
    second = _explained_once(replace(bench, study=wider), progress, rows, first)
    found = second.explanation
    named = found.verdict in STRENGTH_TOLD
    better = named and _is_better(first, second)
    if not (better or (named and _speaks_against_named(first, second))):
        return _with_rarer_tried(first, none)
    text, rivals = RARER.format(text=found.text, count=len(rarer)), found.rivals
    if not better:
        text, rivals = _beside_named(first, second, len(rarer))
    unlike = "; ".join([*filter(None, [found.unlike]), SECOND_PASS])
    doubted = replace(
        found, text=text, rivals=rivals, unlike=unlike, wrong_probability=None,
        wrong_at_most=None, tried_rarer=True,
    )  # fmt: skip
    # Usual effects found nothing to explain: one of many rarer ones is not named with confidence.
    surely = better and told.verdict != "nothing_missing"
    if found.verdict == "missing_effect" and not surely:
        doubted = _unsure(doubted)
    return replace(second, explanation=doubted)


def _beside_named(first: Explained, second: Explained, count: int) -> tuple[str, list[str]]:
    """Text and rivals of what rarer effects explain, where a usual one was named that leaves much.

    Args:
        first, second: the explanations by usual effects and by all.
        count: rarer effects that were tried.
    """
    named, found = first.rows[0].label, second.explanation
    others = dict.fromkeys([*found.rivals, named])
    text = BESIDE.format(text=found.text, count=count, what=named)
    return text, [label for label in others if label != second.rows[0].label]


def _speaks_against_named(first: Explained, second: Explained) -> bool:
    """Whether rarer effects explain as much as one that is named alone, or clearly more.

    Clearly more: less than half of the energy above noise that it leaves.
    """
    before, after = first.explanation, second.explanation
    if before.verdict != "missing_effect" or before.beside:
        return False
    label, alike = first.rows[0].label, [second.rows[0].label, *after.rivals]
    if after.verdict == "undetermined" and label in alike:
        return True
    named, rarer, floor = first.rows[0].fitted, second.rows[0].fitted, first.bench.floor
    if named is None or rarer is None or not second.rows[0].accepted:
        return False
    held_out = floor.left_over(named.held_out, rarer.held_out)
    return max(held_out, floor.of_training.left_over(named.train, rarer.train)) < HALF


def _asks_for_rarer(found: Explained) -> bool:
    """Whether no effect is found, or what is named leaves much.

    Fits of a model without states are quick, so that there more than noise is enough.
    """
    told, bench, best = found.explanation, found.bench, found.rows[0] if found.rows else None
    if told.verdict not in STRENGTH_TOLD:
        return told.verdict == "unknown_effect"
    if told.beside or told.also or best is None or best.fitted is None or bench.study.model.states:
        return told.remains > 0.0
    return not own_floor(bench.study, bench.data, bench.floor, best).reached(best.fitted.held_out)


def _only_training_may_ask(found: Explained) -> bool:
    """Whether nothing held out is missing at the first step of a free run."""
    told, bench = found.explanation, found.bench
    if bench.data.along_motion or bench.base.placements:
        return False
    if any(row.accepted for row in found.rows):
        return False
    at_floor = bench.floor.reached(bench.base.held_out)
    return told.verdict == "nothing_missing" or (told.verdict == "undetermined" and at_floor)


def _is_better(first: Explained, second: Explained) -> bool:
    """Whether the explanation by all effects is to be told in place of that by the usual ones."""
    if _only_training_may_ask(first):
        return _trains_better(first, second.rows[0])
    found = second.explanation
    return not found.remains and (bool(found.beside) or _halves(first, second.rows[0]))


def _trains_better(first: Explained, row: Ranked) -> bool:
    """Whether the training certainly asks for an effect, more than for what was named before."""
    named = first.explanation.verdict in STRENGTH_TOLD
    before = first.rows[0].fitted if named else first.bench.base
    if before is None or row.fitted is None or row.p_value >= SHOWN:
        return False
    return row.fitted.train_error < (1 - MATERIAL) * before.train_error


def _leaves_less(first: Explained, row: Ranked) -> bool:
    """Whether an effect leaves less than what was named before, alone or in a set that it leads.

    Where none was, the training may ask for an effect that what is held out shows only beside
    another, as a drift beside a dead band.
    """
    named = first.explanation.verdict in STRENGTH_TOLD
    if not row.accepted:
        return not named and _certainly_trains(first.bench, row)
    return not (named and row.held_out_error > first.rows[0].held_out_error)


def _certainly_trains(bench: Bench, row: Ranked) -> bool:
    """Whether an effect explains half of the training's error above noise, and not by chance."""
    if row.fitted is None or row.p_value >= SHOWN:
        return False
    return bench.floor.of_training.left_over(bench.base.train, row.fitted.train) <= HALF


def _halves(first: Explained, row: Ranked) -> bool:
    """Whether an effect leaves at most half the error above noise of what was named, if any was."""
    if not row.accepted or first.explanation.verdict not in STRENGTH_TOLD:
        return row.accepted
    before, after = first.rows[0].fitted, row.fitted
    if before is None or after is None:
        return False
    return first.bench.floor.left_over(before.held_out, after.held_out) <= HALF**2


def _with_rarer_tried(found: Explained, more: str) -> Explained:
    """An explanation after the rarer effects; with a further remark if it names no effect."""
    told = replace(found.explanation, tried_rarer=True)
    text = f"{told.text}; {more}" if told.verdict == "unknown_effect" else told.text
    return replace(found, explanation=replace(told, text=text))


def with_whole_library(study: Study) -> Study:
    """The study with the library's rarer effects among those that are ranked."""
    return replace(study, file=structs.replace(study.file, whole_library=True))


def _explained_once(
    bench: Bench,
    progress: Progress,
    ranked: list[Ranked] | None = None,
    first: Explained | None = None,
) -> Explained:
    """The explanation by the effects that the study ranks.

    Args:
        bench, progress: as for `explained`.
        ranked: the ranking, if there is one.
        first: an explanation by fewer effects. What may stand in place of the last accepted effect
            was sought in the whole library there, and is not sought again.
    """
    bench, rows, verdict = _ranked(bench, progress, ranked)
    bench = with_lower_floor(bench, rows)
    healthy = bench.data.healthy is not None
    if verdict.word in STRENGTH_TOLD and bench.data.along_motion and healthy:
        progress("finding what the healthy recording leaves open of the strength")
    fitted_in, rows, verdict = _with_closer_strength(bench, rows, verdict)
    found = _unless_open(explanation(bench, rows, verdict, fitted_in), verdict)
    if not (bench.study.file.effects and _asks_for_exchange(bench, verdict)):
        return Explained(bench, rows, found)
    offer = first.offer if first is not None and first.sought else exchange(bench, progress)
    return Explained(
        bench, rows, _with_exchange(bench, found, verdict, offer), sought=True, offer=offer
    )


def _with_closer_strength(
    bench: Bench, rows: list[Ranked], verdict: Verdict
) -> tuple[Bench, list[Ranked], Verdict]:
    """Ranking and verdict, with the effect named as it is beside the healthy recording.

    Kept at a wrong one of the points that describe a healthy rig, the model leaves more than noise
    even of the right effect, whose strength is then off. Returns the bench of its fit as well.
    """
    best = verdict.best
    alone = verdict.word == "missing_effect" and not (verdict.beside or verdict.second)
    if not alone or best is None or best.fitted is None or bench.study.file.effects:
        return bench, rows, verdict
    if bench.floor.reached(best.fitted.held_out):
        return bench, rows, verdict
    closer = fitted_beside_healthy(bench, best)
    if closer is None:
        return bench, rows, verdict
    both, row = closer
    assert row.fitted is not None
    unit, left = bench.base.told_in, told(row.held_out_error, bench.base.told_in)
    text = f"{verdict.text}; with the healthy recording in the training to {left:.3g} {unit}"
    rows = [row if each is best else each for each in rows]
    return both, rows, replace(verdict, best=row, text=text)


def _asks_for_exchange(bench: Bench, verdict: Verdict) -> bool:
    """Whether too much is left to trust the last accepted effect: it may be of too simple a kind.

    Beside a slider that should be behind play, another effect may stand for the play.
    """
    best = verdict.best
    if verdict.word != "missing_effect" or best is None or best.fitted is None:
        return verdict.word == "unknown_effect"
    floor = own_floor(bench.study, bench.data, bench.floor, best)
    return not floor.reached(best.fitted.held_out)


def _with_exchange(
    bench: Bench, found: Explanation, verdict: Verdict, offer: Exchange | None
) -> Explanation:
    """The explanation with the effect that fits better than the last accepted one, if any does.

    If an effect is named that leaves more beside the accepted one, it is undetermined.
    """
    named = verdict.best if verdict.word == "missing_effect" else None
    if offer is None or (named is not None and not _speaks_against(offer, named)):
        return found
    unit = bench.base.told_in
    told_offer = offer.text(unit, str(bench.study.folder))
    if named is None:
        return replace(found, text=f"{found.text}; but {told_offer}", exchange=offer)
    left = told(named.held_out_error, unit)
    text = f"{told_offer}; {named.label} beside {offer.instead_of}@{offer.port} only to {left:.3g}"
    rivals = [*found.rivals, f"{offer.effect}@{offer.port}"]
    return replace(
        found, verdict="undetermined", text=f"{text} {unit}", rivals=rivals, exchange=offer
    )


def _speaks_against(offer: Exchange, named: Ranked) -> bool:
    """Whether an exchange leaves materially less than an effect that is not the one it offers."""
    same = named.label == f"{offer.effect}@{offer.port}"
    return not same and named.held_out_error > (1 + MATERIAL) * offer.held_out_error


def ranking(bench: Bench, progress: Progress = no_progress) -> tuple[list[Ranked], Verdict]:
    """The ranking, with the effect named by the verdict first, and the verdict."""
    return _ranked(bench, progress)[1:]


def _ranked(
    bench: Bench, progress: Progress, rows: list[Ranked] | None = None
) -> tuple[Bench, list[Ranked], Verdict]:
    """The study with its hold decided, its ranking, and the verdict; `rows` if it is ranked."""
    stopped = _stopped(bench)
    if stopped is None:
        return _ranked_on(bench, progress, rows)
    if _may_lack_an_effect(bench):
        judged, ranked, found = _ranked_on(bench, progress, rows)
        if _leaves_only_noise(judged, found):
            told = BASE_NOT_CONVERGED.format(why=stopped.text.partition(";")[0])
            return judged, ranked, replace(found, text=f"{found.text}; {told}")
    rows = rank_all(bench.study, bench.data, bench.base)
    return bench, rows, with_base_offered(bench, stopped)


def _ranked_on(
    bench: Bench, progress: Progress, rows: list[Ranked] | None
) -> tuple[Bench, list[Ranked], Verdict]:
    """`_ranked`, whether or not the model is fit to judge effects."""
    bench, rows = _beside_best_base(bench, progress, rows)
    decided = with_hold_decided(bench, rows, progress)
    bench, rows = decided.bench, decided.rows
    found, verdict = _judged(with_lower_floor(bench, rows), rows, progress)
    return bench, found, _with_rival_hold(decided, verdict)


def _may_lack_an_effect(bench: Bench) -> bool:
    """Whether a free run's starts do not agree, as they may where an effect is missing."""
    if bench.data.along_motion or bench.study.model.rough or reversed_channel(bench) is not None:
        return False
    return not_converged({"the model": bench.base.convergence}) is not None


def _leaves_only_noise(bench: Bench, found: Verdict) -> bool:
    """Whether the effect named leaves only noise: nothing else could describe the logs better."""
    best = found.best
    if found.word != "missing_effect" or found.beside or best is None or best.fitted is None:
        return False
    return leaves_only_noise(bench.study, bench.data, bench.floor, best)


def _beside_best_base(
    bench: Bench, progress: Progress, rows: list[Ranked] | None
) -> tuple[Bench, list[Ranked]]:
    """The study with its model's best fit, and the ranking beside it; `rows` if it is ranked.

    An effect may only have led the fit out of a local minimum: then the model, begun where the fit
    with the effect ended, leaves as little without it.
    """
    rows = rows or rank(bench.study, bench.data, bench.base, bench.floor, progress)
    base, larger = bench.base, [row.fitted for row in in_order(rows) if row.fitted is not None]
    if larger and not bench.floor.reached(base.held_out):
        least = min(larger, key=lambda fitted: fitted.train_error)
        for fitted in dict.fromkeys((larger[0], least)):
            base = begun_from_larger(bench.study, bench.data, base, fitted)
    if base is bench.base:
        return bench, rows
    progress("the current model leaves less from other values: ranking the effects again")
    return _beside_best_base(with_base(bench, base), progress, None)


def _judged(bench: Bench, rows: list[Ranked], progress: Progress) -> tuple[list[Ranked], Verdict]:
    """The verdict on a ranking, with the effect that it names first."""
    refused = refusals(bench.study)
    verdict = credible_verdict(bench, rows, refused)
    rows, verdict = _refined(bench, rows, verdict, refused, progress)
    along = bench.data.along_motion
    # Sets of effects are judged by whether only noise is left, which a rough model never reaches.
    if along or bench.study.model.rough:
        verdict = _by_pairs(bench, rows, verdict, progress)
    elif may_need_several(bench, verdict):
        verdict = several_effects(bench, rows, verdict, progress)
        verdict = with_like_ports(bench, rows, verdict, progress)
    rows, verdict = with_rarer_rivals(bench, rows, verdict, progress)
    verdict = unless_refused(refused, with_motion_sensor(bench, verdict))
    verdict = with_reversed_port(bench, rows, unless_resampled(bench, verdict))
    if along and bench.study.model.rough:
        verdict = limited_verdict(bench.base, rows, bench.floor, verdict)
    elif along:
        verdict = undetermined_if_much_left(bench.base, bench.floor, verdict)
        verdict = undetermined_if_little_and_unexplained(bench.base, bench.floor, verdict)
        verdict = undetermined_if_parameters_changed(bench, verdict, progress)
    verdict = cannot_tell(bench, rows, verdict)
    verdict = undetermined_if_training_asks(bench, rows, stopped_by_outliers(bench, verdict))
    verdict = with_base_offered(bench, unchecked(bench, verdict))
    verdict = with_unjudged_told(bench, with_change_told(bench.study, verdict))
    if verdict.best is not None:
        rows = [verdict.best, *(row for row in rows if row is not verdict.best)]
    return rows, verdict


def _with_rival_hold(decided: Decided, verdict: Verdict) -> Verdict:
    """The verdict, undetermined if another effect explains as much with another hold."""
    rival = decided.rival
    if verdict.word != "missing_effect" or not rival or rival in verdict.members:
        return verdict
    rivals = (*verdict.rivals, rival)
    return replace(verdict, word="undetermined", rivals=rivals, text=decided.text)


def _refined(
    bench: Bench,
    rows: list[Ranked],
    verdict: Verdict,
    refused: Refusals,
    progress: Progress,
) -> tuple[list[Ranked], Verdict]:
    """Ranking and verdict with refinements of the best effect, if it leaves much along the motion.

    Verdicts on free runs are calibrated without them.
    """
    best = verdict.best
    if not bench.data.along_motion or best is None or best.fitted is None:
        return rows, verdict
    if not much_left(bench.base, bench.floor, best.fitted):
        return rows, verdict
    known = {row.label for row in rows}
    refined = with_refinements(bench.study, bench.data, bench.base, rows, best, progress)
    finer = [row for row in refined if row.label not in known and _explains_the_rest(bench, row)]
    if not finer:
        return rows, verdict
    # The coarser effect is named in place of a finer one while other physics is missing.
    best.accepted, best.reason = False, f"leaves much that {finer[0].label} explains"
    return refined, credible_verdict(bench, refined, refused)


def _explains_the_rest(bench: Bench, row: Ranked) -> bool:
    fitted = row.fitted if row.accepted else None
    return fitted is not None and not much_left(bench.base, bench.floor, fitted)


def _by_pairs(bench: Bench, rows: list[Ranked], verdict: Verdict, progress: Progress) -> Verdict:
    """The verdict after trying pairs, if one effect alone leaves a large residual or a part of it.

    If only a part is left, the verdict changes only if a pair leaves nothing.
    """
    along = bench.data.along_motion
    much = verdict.word == "unknown_effect" or (
        along and leaves_much(bench.base, bench.floor, verdict)
    )
    some = along and not bench.study.model.rough and leaves_some(bench.base, bench.floor, verdict)
    best, shared = verdict.best, bench.study.model.presence is not None
    if not (much or some) or (best is None and not shared):
        return verdict
    size = "a large residual" if much else "a part of the residual"
    alone = "no effect is accepted alone" if best is None else f"{best.label} leaves {size}"
    progress(f"{alone}: trying two effects at once")
    return two_effects(bench, rows, verdict, progress, tolerant=much)


def _stopped(bench: Bench) -> Verdict | None:
    """The verdict if the model is not fit to judge effects, otherwise None."""
    kept, bare = bench.study.kept, bench.bare
    if (reverse := reversed_channel(bench)) is not None:
        return reverse
    failed = not_converged({"the model": bench.base.convergence})
    if failed is not None:
        return with_failure_told(bench, failed)
    ended = {
        "the model to the healthy recording": bare.convergence if bare else None,
        "the kept parameters to the healthy recording": kept.convergence if kept else None,
    }
    return not_converged(ended) or inadequate(bench) or unexcited(bench)
