"""Two effects at once: every pair is scored, and the most promising are fitted.

Adding effects one at a time can fail: the best single effect may stand in for two true ones. To
first order all pairs follow from the ranking of single effects: with a and b the shares of the
residual's amplitude that two directions explain alone, and c their cosine,

    explained = (a² + b² - 2·a·b·c) / (1 - c²),   strengths ∝ (a - b·c), (b - a·c)

The most promising pairs are fitted; the held-out error decides. If none of them explains the error,
effects of the best pair give way to refinements of them, as a spring beside a seal is the right
kind of physics but its middle elsewhere.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rigwatch.physics.engine.compile import side_by_side
from rigwatch.physics.engine.score import ALIKE
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, spoils_healthy
from rigwatch.workbench.explain.rough_verdict import acts_alone, much_left
from rigwatch.workbench.explain.verdict import Verdict, Word, judge
from rigwatch.workbench.fit import Fitted, fit_model
from rigwatch.workbench.ranking import (
    SIMILAR,
    Progress,
    Ranked,
    judge_fit,
    promises_more,
    refinements,
    refit,
    same_family,
    values_of_base,
)

LIKELY = 0.7
"""Share of the energy above the floor a pair must explain, to first order, to be fitted."""
MOST_PAIRS = 4


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects.

    Attributes:
        one, other: rows of the ranking; the one that explains more alone comes first.
        explained: share of the training residual's energy that both explain to first order.
        start: initial values of the fit, by the system's names.
    """

    one: Ranked
    other: Ranked
    explained: float
    start: dict[str, float]

    @property
    def free(self) -> int:
        """Number of free parameters of both effects."""
        return self.one.free + self.other.free

    @property
    def sampled(self) -> int:
        """Number of effects of the pair that act on samples."""
        return sum(row.placement.effect.sampled for row in (self.one, self.other))


def two_effects(
    bench: Bench,
    rows: Sequence[Ranked],
    verdict: Verdict,
    progress: Progress,
    *,
    tolerant: bool = True,
) -> Verdict:
    """The verdict after trying pairs; the same effect if no pair explains the error.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: the verdict on single effects, none of which explains the error alone.
        progress: called with the pair about to be fitted.
        tolerant: whether a pair along the measured motion may leave more than the noise floor.
    """
    fits = _fitted(bench, likely_pairs(bench, rows), progress)
    good = _explaining(bench, fits, tolerant=tolerant)
    if fits and not good:
        rows, fits = _refined(bench, rows, fits, progress)
        good = _explaining(bench, fits, tolerant=tolerant)
    if _is_alone(bench, verdict, fits):
        return dataclasses.replace(verdict, alone=True)
    # Of a pair with a finer law than is named beside the other effect, the plain one is in another.
    for best, together in sorted(good, key=lambda found: found[1].held_out_error):
        first = _verdict_with(bench, rows, fits, best.other, best.one)
        second = _verdict_with(bench, rows, fits, best.one, best.other)
        if first is not None and second is not None:
            found = _both_named(bench, first, second, together)
            return dataclasses.replace(found, best=_row(rows, found.best))
    return verdict


def _is_alone(bench: Bench, verdict: Verdict, fits: Sequence[tuple[Pair, Fitted]]) -> bool:
    """Whether no pair leaves much less than the single effect named."""
    if bench.study.model.rough:
        return False
    return acts_alone(bench.base, bench.floor, verdict, [fitted for _, fitted in fits])


def likely_pairs(bench: Bench, rows: Sequence[Ranked]) -> list[Pair]:
    """The pairs that explain most to first order, without near-duplicates."""
    least = LIKELY * bench.floor.above(bench.base.train)
    every = [_pair(one, other) for one, other in combinations(rows, 2)]
    likely = [pair for pair in every if pair is not None and pair.explained > least]
    chosen: list[Pair] = []
    # Of pairs that explain equally much, those with effects on samples come last.
    for pair in sorted(likely, key=lambda pair: (-round(pair.explained, 2), pair.sampled)):
        if len(chosen) < MOST_PAIRS and not any(_same(pair, other) for other in chosen):
            chosen.append(pair)
    return chosen


def _pair(one: Ranked, other: Ranked) -> Pair | None:
    """The pair; None if the two are too similar, or if one changes sign in the joint fit."""
    if other.explained > one.explained:
        one, other = other, one
    cosine = one.signed_cosines.get(other.label, 0.0)
    if abs(cosine) > SIMILAR:
        return None
    a, b = np.sqrt(one.explained), np.sqrt(other.explained)
    # Amplitudes of the joint fit; a sign other than alone means that the pair is not meaningful.
    shares = (a - b * cosine) / (1 - cosine**2), (b - a * cosine) / (1 - cosine**2)
    if min(shares) <= 0:
        return None
    explained = a * shares[0] + b * shares[1]
    start = one.begin(float(shares[0] / a)) | other.begin(float(shares[1] / max(b, 1e-12)))
    return Pair(one, other, float(explained), start)


def _same(pair: Pair, other: Pair) -> bool:
    """Whether two pairs are equivalent and the other has no more parameters."""
    straight = _parallel(pair.one, other.one) and _parallel(pair.other, other.other)
    crossed = _parallel(pair.one, other.other) and _parallel(pair.other, other.one)
    return (straight or crossed) and other.free <= pair.free


def _parallel(row: Ranked, other: Ranked) -> bool:
    return row is other or row.cosines[other.label] > ALIKE


def _fitted(bench: Bench, pairs: Sequence[Pair], progress: Progress) -> list[tuple[Pair, Fitted]]:
    """The pairs whose fit succeeds, with their fits."""
    for pair in pairs:
        progress(f"fitting {pair.one.label} and {pair.other.label} at once")
    fits = side_by_side(lambda pair: _fitted_pair(bench, pair), pairs)
    return [(pair, fitted) for pair, fitted in zip(pairs, fits, strict=True) if fitted is not None]


def _fitted_pair(bench: Bench, pair: Pair) -> Fitted | None:
    """The model with both effects; None if it cannot be fitted."""
    base = bench.base
    placements = (*base.placements, pair.one.placement, pair.other.placement)
    start = values_of_base(bench.study, base) | pair.start
    try:
        return fit_model(bench.study, bench.data, placements, start, base.train.scale, base=base)
    except ModelError:
        return None


def _refined(
    bench: Bench, rows: Sequence[Ranked], fits: Sequence[tuple[Pair, Fitted]], progress: Progress
) -> tuple[list[Ranked], list[tuple[Pair, Fitted]]]:
    """Rows and fitted pairs, with refinements of the effects of the best pair.

    Beside a refinement stands the other effect, or the one of its family that alone fits best: of
    nearly parallel directions only one is in a pair, and the finer law may be the one that is left.
    """
    best, _ = min(fits, key=lambda found: found[1].held_out_error)
    both = (best.one, best.other)
    added = refinements(bench.study, bench.data, bench.base, rows, both)
    promising = [
        (row, beside)
        for row in added
        for beside in both
        if row.placement.effect.refines != beside.effect or row.port != beside.port
        if (pair := _pair(row, beside)) is not None
        if promises_more(pair.explained, best.explained)
    ]
    kin = [(row, _best_of_family(beside, rows)) for row, beside in promising]
    pairs = [pair for row, beside in dict.fromkeys(promising + kin) if (pair := _pair(row, beside))]
    return [*rows, *added], [*fits, *_fitted(bench, pairs[:MOST_PAIRS], progress)]


def _best_of_family(one: Ranked, rows: Sequence[Ranked]) -> Ranked:
    """The effect of a row's family at its port that alone leaves the smallest held-out error."""
    kin = [row for row in rows if same_family(one, row) and row.port == one.port]
    return min(kin, key=lambda row: row.held_out_error, default=one)


def _explaining(
    bench: Bench, fits: Sequence[tuple[Pair, Fitted]], *, tolerant: bool
) -> list[tuple[Pair, Fitted]]:
    """Pairs whose residual is small enough for them to be named.

    The residual must be at the noise floor, since two wrong effects together explain much. A rough
    model, and any model along the measured motion, is allowed more, since a fault changes the
    model's own residual.
    """
    floor = bench.floor
    tolerant = tolerant and (bench.data.along_motion or bench.study.model.rough)
    return [
        (pair, fitted)
        for pair, fitted in fits
        if floor.reached(fitted.held_out) or (tolerant and not much_left(bench.base, floor, fitted))
        if not spoils_healthy(bench, fitted)
    ]


def _verdict_with(
    bench: Bench,
    rows: Sequence[Ranked],
    fits: Sequence[tuple[Pair, Fitted]],
    known: Ranked,
    wanted: Ranked,
) -> Verdict | None:
    """The verdict with one effect of a pair in the model; None if it does not name `wanted`."""
    known = dataclasses.replace(known)
    if known.fitted is None:
        refit(bench.study, bench.data, bench.base, known)
    if known.fitted is None:
        return None
    among = []
    for row in rows:
        if row.label == known.label:
            continue
        both = {row.label, known.label}
        together = (f for pair, f in fits if {pair.one.label, pair.other.label} == both)
        joint = dataclasses.replace(row, fitted=next(together, None), accepted=False)
        if joint.fitted is not None:
            judge_fit(known.fitted, joint)
        among.append(joint)
    found = judge(known.fitted, among, bench.floor)
    return found if wanted.label in (*found.members, *found.rivals) else None


def _row(rows: Sequence[Ranked], found: Ranked | None) -> Ranked | None:
    """The single-effect row of an effect that was found together with another."""
    return next((row for row in rows if found is not None and row.label == found.label), None)


def _both_named(bench: Bench, first: Verdict, second: Verdict, together: Fitted) -> Verdict:
    """The verdict that names both effects."""
    named = (*second.members, *second.rivals)
    assert first.best is not None
    reached = bench.floor.reached(together.held_out)
    certain = reached and not (first.rivals or second.rivals)
    word: Word = "missing_effect" if certain else "undetermined"
    also = f"{named[0]} as well" if certain else f"probably {' or '.join(named)} as well"
    text = f"{first.best.label} is missing, and {also}"
    return dataclasses.replace(first, word=word, text=text, second=named, together=together)
