"""The verdict: the conclusion from the ranking, in one of five words.

`nothing_missing`, `missing_effect`, `undetermined` (rivals of different physics that this recording
cannot distinguish), `unknown_effect` (the error stays above the noise floor, and no known effect
explains it) or `model_inadequate` (the model's fit did not converge or does not describe the
healthy rig, see `adequacy/`; no effect is named). All five are valid results.

Of effects with equal held-out errors, the one with the fewest parameters is named first; the others
of its kind form its class.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from rigwatch.physics.engine.search import Convergence
from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.contradicting import (
    CONTRADICTED,
    explaining_all,
    explaining_training,
    favoured_by_training,
    leads_held_out,
    leaves_less_of_all,
    not_refuted,
)
from rigwatch.workbench.explain.indistinguishable import (
    as_good,
    as_near_as_own_error,
    at_other_ports,
    equal,
    lead,
    plainest,
    undistinguished,
)
from rigwatch.workbench.explain.remaining_error import (
    GOES_ELSEWHERE,
    explains,
    explains_little,
    hardly_trains,
    other_accepted,
    remaining_error,
)
from rigwatch.workbench.explain.verdict_calibration import CLEAR, Evidence, probability_wrong
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import (
    MATERIAL,
    NEAR,
    Ranked,
    error_ratio,
    lowest,
    same_family,
)

Word = Literal[
    "nothing_missing", "missing_effect", "undetermined", "unknown_effect", "model_inadequate"
]
LITTLE_MORE = 0.01
"""Relative difference of errors too small to justify a further parameter above the noise floor;
within a family it is `MATERIAL`."""
CHANCE = 0.05
"""p-value of the best effect from which coloured noise explains the error as well."""
SLIGHT = 0.002
"""Share of the error's energy above the floor that a finer law of the same physics must explain
beyond a simpler one to be named in place of it."""
MOST_OF_IT = 0.75
"""Share of the best effect's gain that an effect of lower order needs to be named instead."""
SEVERAL, NEARLY_ALL = 2, 0.98
"""Further parameters of an effect along the measured motion that a simple one is named in place of,
and the share of its gain that the simple one needs: a spring gains 99 % of what a contact that
slips does on a rig that nobody here had built."""


@dataclass(frozen=True)
class Verdict:
    """What is missing.

    Attributes:
        word: one of five.
        best: the effect named, None if there is none.
        members: labels of the best's class: itself first, then effects equivalent to it.
        rivals: labels of effects of other physics that this recording cannot distinguish from it.
        text: the verdict in a sentence.
        second: labels of the second missing effect, if two are missing at once.
        evidence: what the verdict is based on.
        beside: labels of the other effects of the set that it was judged in.
        together: the fit with all effects that are missing at once, if several are.
        alone: whether a second effect was sought that explains what it leaves, and none does.
    """

    word: Word
    best: Ranked | None
    members: tuple[str, ...]
    rivals: tuple[str, ...]
    text: str
    second: tuple[str, ...] = ()
    evidence: Evidence = field(default_factory=Evidence)
    beside: tuple[str, ...] = ()
    together: Fitted | None = None
    alone: bool = False

    @property
    def probability_wrong(self) -> float:
        """Probability that the verdict is wrong, calibrated on simulated cases."""
        return probability_wrong(self.word, self.evidence)


def not_converged(fits: Mapping[str, Convergence | None]) -> Verdict | None:
    """`model_inadequate` if a fit that others build on did not converge, otherwise None.

    Args:
        fits: convergence of each fit, by a description of the fitted model.
    """
    for name, ended in fits.items():
        if ended is not None and not ended.converged:
            text = f"the fit of {name} did not converge: {ended.reason}"
            if ended.undetermined:
                text += f"; the data do not determine {', '.join(ended.undetermined)}"
            return Verdict("model_inadequate", None, (), (), text)
    return None


def judge(base: Fitted, rows: Sequence[Ranked], floor: NoiseFloor) -> Verdict:
    """The verdict on a ranking; `floor` is the noise floor of the held-out recordings."""
    if floor.lower_limit and floor.reached(base.held_out):
        _refuse_what_hardly_trains(base, rows)
    accepted = [row for row in rows if row.accepted]
    if not accepted:
        return _nothing_found(base, rows, floor)
    best = _named(base, accepted, floor)
    assert best.fitted is not None
    trusted = floor.reached(best.fitted.held_out)
    members, rivals = undistinguished(best, rows, trusted=trusted)
    if floor.method == "healthy motion":
        known = (*members, *rivals)
        if trusted:
            rivals = (*rivals, *as_near_as_own_error(best, rows, known, floor))
        else:
            rivals = (*rivals, *at_other_ports(best, rows, known))
    evidence = Evidence(
        floor.left_over(base.held_out, best.fitted.held_out), _margin(best, rows, members + rivals)
    )
    word, text = _word(base, best, as_good(best, rows, members), rivals, floor)
    ahead = None if trusted else _passed_over(best, accepted)
    if word == "missing_effect":
        doubt = _doubt(base, best, ahead, rows, floor, members=members, trusted=trusted)
        word, rivals, text = doubt or (word, rivals, text)
    if word == "undetermined" and ahead is not None and ahead.label not in (*members, *rivals):
        rivals = (*rivals, ahead.label)
    text += remaining_error(base, best, floor) + other_accepted(rows, (*members, *rivals))
    return Verdict(word, best, members, rivals, text, evidence=evidence)


def _doubt(
    base: Fitted,
    best: Ranked,
    ahead: Ranked | None,
    rows: Sequence[Ranked],
    floor: NoiseFloor,
    *,
    members: Sequence[str],
    trusted: bool,
) -> tuple[Word, tuple[str, ...], str] | None:
    """Verdict, rivals and sentence if other recordings speak for other effects; otherwise None.

    Args:
        base, best, rows, floor: the model, the effect named, the ranking and the noise floor.
        ahead: the effect that was passed over for its parameters.
        members: labels of the class of the effect named.
        trusted: whether the effect named reaches the noise floor.
    """
    leads = f"{best.label} lowers the held-out error most"
    if ahead is not None:
        leads += f" of those as simple ({ahead.label} lowers it further)"
    if not trusted and (elsewhere := explaining_training(base, best, rows)):
        much = f"more than {CONTRADICTED:g} times as much of the training error"
        return "undetermined", elsewhere, f"{leads}, but {', '.join(elsewhere)} explains {much}"
    if better := explaining_all(base, best, members, rows, floor):
        more = "more of all recordings together"
        return "undetermined", better, f"{leads}, but {', '.join(better)} explains {more}"
    if hardly_trains(base, best, floor):
        text = f"the best known effect, {best.label}, leaves nearly all of the training error"
        return "unknown_effect", (), text
    if others := favoured_by_training(base, best, rows, floor):
        more = f"more of the training error, much of which {best.label} leaves"
        if ahead is None and any(row.label in others and leads_held_out(best, row) for row in rows):
            leads += " of those as simple"
        return "undetermined", others, f"{leads}, but {', '.join(others)} explains {more}"
    if untold := not_refuted(base, best, rows, floor):
        why = "resembles the residual more, and its fit ended in a local minimum or failed"
        return "undetermined", untold, f"{leads}, but {', '.join(untold)} {why}"
    return None


def _refuse_what_hardly_trains(base: Fitted, rows: Sequence[Ranked]) -> None:
    """Refuse what hardly lowers the training error where only noise is to be explained.

    What is left there may still repeat, as at the reversals of a cyclic test, and an effect that
    follows it in one recording lowers the error held out without being there.
    """
    for row in rows:
        if row.accepted and row.fitted is not None:
            fall = 1 - row.fitted.train_error / max(base.train_error, 1e-300)
            if fall < MATERIAL:
                row.accepted = False
                row.reason = (
                    f"at the noise floor, and training error falls by less than {MATERIAL:.0%}"
                )


def _word(
    base: Fitted,
    best: Ranked,
    others: Sequence[str],
    rivals: Sequence[str],
    floor: NoiseFloor,
) -> tuple[Word, str]:
    """The verdict if an effect lowers the error, and its sentence.

    Args:
        base, best, floor: the model, the effect named and the noise floor.
        others: labels of those of its class that leave as little.
        rivals: labels of effects of other physics that do as well.
    """
    if explains_little(base, best, floor):
        return "unknown_effect", (
            f"the best known effect, {best.label}, leaves much of the error above the noise floor"
        )
    if rivals:
        return "undetermined", (
            f"{best.label} and {', '.join(rivals)} explain this recording equally well"
        )
    assert best.fitted is not None
    alike = f" (or {', '.join(others)}: this recording cannot tell them apart)" if others else ""
    return "missing_effect", (
        f"{best.label}{alike} is missing: the held-out error falls from {base.told_error:.3g} to"
        f" {best.fitted.told_error:.3g} {base.told_in}"
    )


def _margin(best: Ranked, rows: Sequence[Ranked], confused: tuple[str, ...]) -> float:
    """Standard deviations by which the best beats every effect outside its class and rivals."""
    others = [row for row in rows if row.fitted is not None and row.label not in confused]
    return min((lead(best, row) for row in others), default=CLEAR)


def _nothing_found(base: Fitted, rows: Sequence[Ranked], floor: NoiseFloor) -> Verdict:
    ratio, times = floor.ratio(base.held_out), floor.times(base.held_out)
    text = f"the held-out error is {times:.2f} times the noise floor, and no effect lowers it"
    if floor.reached(base.held_out):
        return Verdict("nothing_missing", None, (), (), text)
    noise = _like_noise(rows, floor)
    # With effects in the model, a little above the least that the noise can be tells nothing.
    if base.placements and noise and ratio < NEAR:
        return Verdict("nothing_missing", None, (), (), text + noise)
    text = f"the held-out error is {times:.2f} times the noise floor, and no "
    text += "known effect lowers it" if rows else "further known effect suits the model's ports"
    fitted = [row for row in rows if row.fitted is not None]
    if fitted:
        nearest = min(fitted, key=lambda row: row.held_out_error)
        text += f"; nearest is {nearest.label}, refused: {nearest.reason}"
    if floor.of_training.reached(base.train):
        noise = f"; the training is described down to its noise, and {GOES_ELSEWHERE}"
    return Verdict("unknown_effect", None, (), (), text + _untried(rows) + noise)


def _untried(rows: Sequence[Ranked]) -> str:
    """A remark on effects that resemble the residual and of which no fit was possible."""
    failed = [row for row in rows if row.likely and row.failure]
    if not failed:
        return ""
    first = min(failed, key=lambda row: row.p_value)
    more = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
    return f"; {first.label}{more} may be it, but cannot be fitted: {first.failure}"


def _like_noise(rows: Sequence[Ranked], floor: NoiseFloor) -> str:
    """A remark where coloured noise alone could be all that is above the noise floor."""
    best = min((row.p_value for row in rows), default=0.0)
    if floor.method != "quiet band" or best < CHANCE:
        return ""
    return (
        f"; it is no more like an effect than coloured noise is (p = {best:.1g}), and this floor"
        " holds for white noise: a healthy recording, or one whose input repeats, would tell"
    )


def _named(base: Fitted, accepted: Sequence[Ranked], floor: NoiseFloor) -> Ranked:
    """Of equal effects, the simplest; above the noise floor, the one that it refines instead.

    While other physics is missing, an effect of higher order also absorbs part of that. It is named
    only if its residual is at the noise floor, or if it alone explains the error.
    """
    top = lowest(accepted)
    equals = [row for row in accepted if _as_good(base, top, row, floor)]
    least = min(map(_simplicity, equals))
    best = plainest(lowest([row for row in equals if _simplicity(row) == least]), accepted)
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out):
        return best
    if floor.method == "healthy motion":
        best = _as_it_acts(best, accepted)
        assert best.fitted is not None
    lower = best.placement.effect.refines
    for row in accepted:
        if row.effect == lower and row.gain and best.gain and row.gain > MOST_OF_IT * best.gain:
            alone = explains(base, best, floor) and not explains(base, row, floor)
            return best if alone else row
    return best if explains(base, best, floor) else _simpler_of_all(best, accepted)


def _as_it_acts(best: Ranked, accepted: Sequence[Ranked]) -> Ranked:
    """In place of an effect with several more parameters, a simple one at its port that it acts as.

    A contact that hardly slips is a spring. What its further parameters gain beyond the spring is
    little, and the model's own error, which another motion changes, has room for as much.
    """
    simple = [
        row
        for row in accepted
        if row.port == best.port and row.free + SEVERAL <= best.free and not same_family(best, row)
        if row.gain and best.gain and row.gain > NEARLY_ALL * best.gain
    ]
    return min(simple, key=lambda row: (row.free, row.held_out_error), default=best)


def _passed_over(best: Ranked, accepted: Sequence[Ranked]) -> Ranked | None:
    """The effect of other physics that leads but has more parameters than the one named; or None.

    It leaves materially less of what is held out and less of all recordings. While more is missing
    that is no reason to name it, but where rivals are told it is one.
    """
    top = lowest(accepted)
    same_physics = same_family(best, top) or top.placement.effect.refines == best.effect
    if top.free <= best.free or same_physics:
        return None
    assert best.fitted is not None
    assert top.fitted is not None
    ahead = error_ratio(best, top) < 1 - MATERIAL
    return top if ahead and leaves_less_of_all(top.fitted, best.fitted) else None


def _simpler_of_all(best: Ranked, accepted: Sequence[Ranked]) -> Ranked:
    """The simpler effect of the best's family that leaves less of all recordings; or the best.

    A further parameter that pays on the few recordings held out alone follows what is missing
    beside it there, as friction that falls with speed does where a supply sags.
    """
    assert best.fitted is not None
    simpler = [
        row
        for row in accepted
        if row.free < best.free and same_family(best, row) and row.fitted is not None
        if leaves_less_of_all(row.fitted, best.fitted)
    ]
    return min(simpler, key=lambda row: (row.free, row.held_out_error), default=best)


def _simplicity(row: Ranked) -> tuple[int, bool]:
    """Order of equal effects: fewest parameters first, effects on samples last."""
    return row.free, row.placement.effect.sampled


def _as_good(base: Fitted, top: Ranked, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether a row is as good as the one with the smallest held-out error.

    Above the noise floor a slightly smaller error does not justify a further parameter. Within one
    family that parameter refines the physics, and has to lower the error as much as an effect has:
    a short bending of the contact follows any rounding of the corner of dry friction.
    """
    assert top.fitted is not None
    if row is top or equal(top, row, 0.0):
        return True
    if same_family(top, row) and row.free < top.free and _gains_little(base, top, row, floor):
        return True
    margin = MATERIAL if same_family(top, row) else LITTLE_MORE
    little = (1 - margin) * error_ratio(top, row) <= 1.0
    return row.free < top.free and little and not floor.reached(top.fitted.held_out)


def _gains_little(base: Fitted, top: Ranked, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether the best explains hardly more of the error above the floor than another row.

    Of the training or of what is held out: what a law has and another lacks shows in both.
    """
    fits = [r.fitted for r in (top, row) if r.fitted]
    held_out = [floor.left_over(base.held_out, each.held_out) for each in fits]
    train = [floor.of_training.left_over(base.train, each.train) for each in fits]
    return min(held_out[-1] - held_out[0], train[-1] - train[0]) < SLIGHT
