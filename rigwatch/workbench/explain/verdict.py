"""The verdict: what the ranking means, in one of five words.

`nothing_missing`, `missing_effect`, `undetermined` (rivals of different physics that this recording
cannot tell apart), `unknown_effect` (the error stays above the noise floor, and no known effect
brings it down) or `model_inadequate` (the model's own fit cannot be relied on, or does not describe
the healthy rig, see `adequacy.py`; no effect is named). All five are results.

Of effects that do equally well on the recordings held out, the one with the fewest parameters is
named first; the others of its kind form its class.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rigwatch.physics.engine.score import ALIKE
from rigwatch.physics.engine.search import Convergence
from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.remainder import (
    accepted_as_well,
    explains,
    explains_too_little,
    what_stays,
)
from rigwatch.workbench.explain.verdict_calibration import CLEAR, Evidence, doubt
from rigwatch.workbench.fit import Fitted, block_differences
from rigwatch.workbench.ranking import SAME, SIMILAR, Ranked

Word = Literal[
    "nothing_missing", "missing_effect", "undetermined", "unknown_effect", "model_inadequate"
]
EQUAL = 2.0
"""Standard deviations of a paired difference below which two effects do equally well."""
NO_DIFFERENCE = 1e-4
"""Relative difference of errors that only says where two fits happened to stop."""
LITTLE_MORE = 0.01
"""Relative difference of errors that is no reason for a further parameter, where more is left."""
PERHAPS = 1.0
"""Standard deviations by which an effect with more parameters may be the better one."""
MUCH_WORSE = 1.5
"""Ratio of held-out errors that no chance favour of what else is missing explains."""
NEARLY = 0.8
"""Share of the best effect's gain from which another one may be right as well."""
MOST_OF_IT = 0.75
"""Share of a gain that an effect of lower order must have to go first."""


@dataclass(frozen=True)
class Verdict:
    """What is missing.

    Attributes:
        word: one of five.
        best: what is named, None where nothing is.
        members: labels that the best cannot be told from, itself first.
        rivals: labels of other physics that this recording cannot tell from it.
        text: a sentence for people.
        second: labels of what is missing as well, where two effects hide at once.
        evidence: what the verdict rests on.
    """

    word: Word
    best: Ranked | None
    members: tuple[str, ...]
    rivals: tuple[str, ...]
    text: str
    second: tuple[str, ...] = ()
    evidence: Evidence = field(default_factory=Evidence)

    @property
    def doubt(self) -> float:
        """Probability of being wrong, calibrated on simulated cases."""
        return doubt(self.word, self.evidence)


def not_converged(fits: Mapping[str, Convergence | None]) -> Verdict | None:
    """The verdict where a fit that the others build on did not converge, None where all did.

    Args:
        fits: how they ended, by what they are of, in words.
    """
    for name, ended in fits.items():
        if ended is not None and not ended.converged:
            text = f"the fit of {name} did not converge: {ended.reason}"
            if ended.undetermined:
                text += f"; the data do not determine {', '.join(ended.undetermined)}"
            return Verdict("model_inadequate", None, (), (), text)
    return None


def judge(base: Fitted, rows: Sequence[Ranked], floor: NoiseFloor) -> Verdict:
    """The verdict on a ranking; `floor` is of the held-out recordings."""
    accepted = [row for row in rows if row.accepted]
    if not accepted:
        return _nothing_found(base, floor)
    best = _named(base, accepted, floor)
    assert best.fitted is not None
    trusted = floor.reached(best.fitted.held_out)
    members, rivals = _undistinguished(best, rows, trusted=trusted)
    if not trusted and floor.method == "healthy motion":
        rivals = (*rivals, *_elsewhere(best, rows, (*members, *rivals)))
    evidence = Evidence(
        floor.left_over(base.held_out, best.fitted.held_out), _margin(best, rows, members + rivals)
    )
    word, text = _word(base, best, rivals, floor)
    text += what_stays(base, best, floor) + accepted_as_well(rows, (*members, *rivals))
    return Verdict(word, best, members, rivals, text, evidence=evidence)


def _word(
    base: Fitted, best: Ranked, rivals: tuple[str, ...], floor: NoiseFloor
) -> tuple[Word, str]:
    """The verdict where an effect lowers the error, and a sentence for people."""
    if explains_too_little(base, best, floor):
        return "unknown_effect", (
            f"the best known effect, {best.label}, leaves much of the error above the noise floor"
        )
    if rivals:
        return "undetermined", (
            f"{best.label} and {', '.join(rivals)} explain this recording equally well"
        )
    return "missing_effect", (
        f"{best.label} is missing: the held-out error falls from {base.held_out_error:.3g} to"
        f" {best.held_out_error:.3g}"
    )


def _margin(best: Ranked, rows: Sequence[Ranked], confused: tuple[str, ...]) -> float:
    """Standard deviations by which the best does better than all that it is not confused with."""
    others = [row for row in rows if row.fitted is not None and row.label not in confused]
    return min((_ahead(best, row) for row in others), default=CLEAR)


def _undistinguished(
    best: Ranked, rows: Sequence[Ranked], *, trusted: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Labels of what this recording cannot tell from the best: its own kind, and other physics.

    Args:
        best: what is named.
        rows: the ranking.
        trusted: whether the best leaves nothing but noise. Where more is left, whatever causes it
            may favour one of two effects that look alike, so that neither rules the other out, and
            an effect with more parameters gains from it without a reason of its own.
    """
    members, rivals = [best.label], []
    for row in rows:
        if row is best:
            continue
        cosine = best.cosines.get(row.label, 0.0)
        if cosine > SAME or _kin(best, row):
            if _equal(best, row, cosine) and _earns(best, row):
                members.append(row.label)
        elif _rivals(best, row, cosine, trusted=trusted):
            rivals.append(row.label)
    return tuple(members), tuple(rivals)


def _rivals(best: Ranked, row: Ranked, cosine: float, *, trusted: bool) -> bool:
    """Whether other physics does as well: with more parameters only if it does no worse."""
    if not row.accepted:
        return False
    if row.free > best.free:
        no_worse = row.held_out_error <= best.held_out_error * (1 + NO_DIFFERENCE)
        better = cosine > SIMILAR and _ahead(row, best) > PERHAPS
        # At another place it is no refinement of the best, whatever its shape needs.
        as_good = row.port != best.port and _equal(best, row, cosine)
        return trusted and ((cosine > ALIKE and (no_worse or as_good)) or better)
    if cosine > ALIKE and not trusted and row.held_out_error < MUCH_WORSE * best.held_out_error:
        return True
    return cosine > SIMILAR and _equal(best, row, cosine)


def _elsewhere(best: Ranked, rows: Sequence[Ranked], known: tuple[str, ...]) -> tuple[str, ...]:
    """Labels of what looks similar at another kind of port, where more than noise is left.

    A sensor that is late in a way that no effect describes is met nearly as well by a late drive.
    """
    return tuple(
        row.label
        for row in rows
        if row.accepted
        and row.label not in known
        and row.kind != best.kind
        and best.cosines.get(row.label, 0.0) > SIMILAR
        and row.held_out_error < MUCH_WORSE * best.held_out_error
        and (row.gain or 0.0) > NEARLY * (best.gain or 0.0)
    )


def _kin(best: Ranked, row: Ranked) -> bool:
    family = best.placement.effect.family
    return bool(family) and row.placement.effect.family == family


def _earns(best: Ranked, row: Ranked) -> bool:
    """Whether it is no refinement, with more parameters or of higher order, without a reason."""
    known = {best.effect, *(name.split("@")[0] for name in best.alike)}
    return row.free <= best.free and row.placement.effect.refines not in known


def _nothing_found(base: Fitted, floor: NoiseFloor) -> Verdict:
    ratio = floor.ratio(base.held_out)
    if floor.reached(base.held_out):
        text = f"the held-out error is {ratio:.2f} times the noise floor, and no effect lowers it"
        return Verdict("nothing_missing", None, (), (), text)
    text = f"the held-out error is {ratio:.2f} times the noise floor, and no known effect lowers it"
    return Verdict("unknown_effect", None, (), (), text)


def _named(base: Fitted, accepted: Sequence[Ranked], floor: NoiseFloor) -> Ranked:
    """Of equals the one with the fewest parameters; what it refines first, while more is missing.

    While more is missing an effect of higher order takes some of that, too. Where it leaves nothing
    but noise, or explains what the other does not, it is what is missing.
    """
    top = min(accepted, key=lambda row: row.held_out_error)
    equals = [row for row in accepted if _as_good(top, row, floor)]
    best = min(equals, key=_simplest)
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out):
        return best
    lower = best.placement.effect.refines
    for row in accepted:
        if row.effect == lower and row.gain and best.gain and row.gain > MOST_OF_IT * best.gain:
            alone = explains(base, best, floor) and not explains(base, row, floor)
            return best if alone else row
    return best


def _simplest(row: Ranked) -> tuple[int, bool, float]:
    """Order of equals: fewest parameters, what a computer does to samples last."""
    return row.free, row.placement.effect.sampled, row.held_out_error


def _as_good(top: Ranked, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether a row is as good as the one that leaves least.

    Where more than noise is left, a little less of it is no reason for a further parameter.
    """
    assert top.fitted is not None
    if row is top or _equal(top, row, 0.0):
        return True
    little = row.held_out_error <= top.held_out_error * (1 + LITTLE_MORE)
    return row.free < top.free and little and not floor.reached(top.fitted.held_out)


def _equal(one: Ranked, other: Ranked, cosine: float) -> bool:
    """Whether two do equally well on the recordings held out; unfitted, whether they are one."""
    if other.fitted is None:
        return cosine > SAME
    assert one.fitted is not None
    if not other.accepted:
        return False
    same = abs(other.held_out_error / one.held_out_error - 1) < NO_DIFFERENCE
    return bool(same or abs(_ahead(one, other)) < EQUAL)


def _ahead(one: Ranked, other: Ranked) -> float:
    """Standard deviations of the paired held-out difference by which one does better."""
    assert one.fitted is not None
    assert other.fitted is not None
    difference = block_differences(other.fitted.held_out, one.fitted.held_out)
    spread = difference.std(ddof=1) / np.sqrt(len(difference))
    return float(difference.mean() / max(spread, 1e-300))
