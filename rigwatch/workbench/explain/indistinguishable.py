"""Effects that a recording cannot tell from the best: its class, and rivals of other physics.

The class are effects of the same physics, or with the same residual to first order, whose error is
the same. Rivals are effects of other physics whose directions are similar and whose errors do not
differ beyond chance, or beyond what other missing physics or the model's own error may favour.
"""

from collections.abc import Sequence

import numpy as np

from rigwatch.physics.engine.equations import library
from rigwatch.physics.engine.score import ALIKE
from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import block_differences
from rigwatch.workbench.ranking import (
    MATERIAL,
    MUCH_WORSE,
    SAME,
    SIMILAR,
    Ranked,
    error_ratio,
    same_family,
)

EQUAL = 2.0
"""Standard deviations by which an effect must be ahead of another, block by block, to rule it out.
An effect may be named for its parameters and be behind.
"""
NO_DIFFERENCE = 1e-4
"""Relative difference of errors that reflects only where two fits stopped."""
A_TRACE = 0.01
"""Relative difference of errors that tells no two effects of a class apart."""
PERHAPS = 1.0
"""Standard deviations by which an effect with more parameters must be ahead to be a rival."""
NEARLY = 0.8
"""Share of the best effect's gain above which another effect may be the right one."""
FAVOURED = 0.125
"""Energy, in that of the healthy error, by which the model's own error may favour an effect."""


def undistinguished(
    best: Ranked, rows: Sequence[Ranked], *, trusted: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Labels of effects that this recording cannot distinguish from the best: class and rivals.

    Args:
        best: the effect named.
        rows: the ranking.
        trusted: whether the best's residual is at the noise floor. If not, the cause of the rest
            may favour one of two similar effects, so that neither rules out the other, and it
            may lower the error of an effect with more parameters for no physical reason.
    """
    members, rivals = [best.label], []
    for row in rows:
        if row is best:
            continue
        cosine = best.cosines.get(row.label, 0.0)
        kin = cosine > SAME or same_family(best, row)
        if _same_shift(best, row) or (kin and _in_class(best, row, cosine, trusted=trusted)):
            members.append(row.label)
        elif not kin and _rivals(best, row, cosine, trusted=trusted):
            rivals.append(row.label)
    rivals += _parallel_to_rivals(rows, rivals, {*members, *rivals})
    refining = {row.label for row in rows if row is not best and _lower(row) in members}
    return tuple(label for label in members if label not in refining), tuple(rivals)


def plainest(best: Ranked, rows: Sequence[Ranked]) -> Ranked:
    """Of effects at the best's port that leave the same by as many parameters, the plainest.

    Where a motion never reverses, drag by direction is drag and an asymmetric gain is a gain. The
    library lists plain laws before those that become the same in a special case.
    """
    same = [best, *(row for row in rows if row is not best and _leaves_the_same(best, row))]
    order = {name: place for place, name in enumerate(library())}
    return min(same, key=lambda row: order.get(row.effect, len(order)))


def _leaves_the_same(best: Ranked, row: Ranked) -> bool:
    if row.port != best.port or row.free != best.free or row.fitted is None or best.fitted is None:
        return False
    train = row.fitted.train_error / best.fitted.train_error
    ratios = (train, error_ratio(best, row))
    return all(abs(ratio - 1) < NO_DIFFERENCE for ratio in ratios)


def _lower(row: Ranked) -> str:
    """Label of the effect that a row's effect describes in more detail, at the same port."""
    return f"{row.placement.effect.refines}@{row.port}"


def _parallel_to_rivals(
    rows: Sequence[Ranked], rivals: Sequence[str], known: set[str]
) -> list[str]:
    """Labels of effects not fitted because they are parallel to a rival that was."""
    return [
        row.label
        for row in rows
        if row.fitted is None
        and row.label not in known
        and any(row.cosines.get(rival, 0.0) > SAME for rival in rivals)
    ]


def _in_class(best: Ranked, row: Ranked, cosine: float, *, trusted: bool) -> bool:
    """Whether a parallel effect, or one of the same family, belongs to the best's class."""
    if equal(best, row, cosine):
        # At another port it does not refine the best, however many parameters its shape has.
        return _is_simple_enough(best, row) or (cosine > SAME and row.port != best.port)
    near = row.held_out_error < MUCH_WORSE * best.held_out_error
    return not trusted and row.accepted and cosine > ALIKE and near and _is_simple_enough(best, row)


def as_good(best: Ranked, rows: Sequence[Ranked], members: Sequence[str]) -> list[str]:
    """Labels of the other members of the best's class that leave no more than a trace more.

    Others belong to it only as long as what else is missing may favour one of them.
    """
    others = [row for row in rows if row.label in members and row is not best]
    return [row.label for row in others if row.fitted is None or _as_small(best, row)]


def _as_small(best: Ranked, row: Ranked) -> bool:
    """Whether its error is no more than a trace larger, if it is accepted."""
    return row.accepted and error_ratio(best, row) < 1 + A_TRACE


def _same_shift(best: Ranked, row: Ranked) -> bool:
    """Whether both shift the machine's only input or only output in time, with the same result.

    A time-invariant machine responds to a delayed input with the same motion, delayed. So it does
    if its other inputs hardly change, as the temperature of a room: both effects are parallel then,
    and which leaves a trace less is decided by what else is not exact.
    """
    shifts = best.placement.effect.time_shift and row.placement.effect.time_shift
    if not shifts or best.fitted is None or row.port == best.port:
        return False
    model = best.fitted.compiled.system.model
    computed = {name for name, port in model.ports.items() if port.signal in model.quantities}
    if computed & {best.port, row.port} or len(model.outputs) > 1:
        return False
    cosine = best.cosines.get(row.label, 0.0)
    if len(model.driving()) == 1:
        return cosine > SIMILAR
    return cosine > SAME and _as_small(best, row)


def _rivals(best: Ranked, row: Ranked, cosine: float, *, trusted: bool) -> bool:
    """Whether an effect of other physics is a rival; with more parameters it must be no worse."""
    if not row.accepted:
        return False
    if row.free > best.free:
        no_worse = error_ratio(best, row) <= 1 + NO_DIFFERENCE
        better = cosine > SIMILAR and lead(row, best) > PERHAPS
        # At another port it does not refine the best, however many parameters its shape has.
        not_worse = row.port != best.port and equal(best, row, cosine)
        return trusted and ((cosine > ALIKE and (no_worse or not_worse)) or better)
    if cosine > ALIKE and not trusted and row.held_out_error < MUCH_WORSE * best.held_out_error:
        return True
    return cosine > SIMILAR and equal(best, row, cosine)


def at_other_ports(best: Ranked, rows: Sequence[Ranked], known: tuple[str, ...]) -> tuple[str, ...]:
    """Labels of similar effects at another kind of port, if the residual is above the noise floor.

    For example, a sensor delay that no effect describes fits nearly as well as a drive delay.
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


def as_near_as_own_error(
    best: Ranked, rows: Sequence[Ranked], known: tuple[str, ...], floor: NoiseFloor
) -> tuple[str, ...]:
    """Labels of similar effects that reach the floor too, so near that model error may decide.

    The model's own error is the same in every block, so that a paired test takes it for evidence.
    """
    assert best.fitted is not None
    most = floor.ratio(best.fitted.held_out) ** 2 + FAVOURED
    return tuple(
        row.label
        for row in rows
        if row.accepted
        and row.fitted is not None
        and row.label not in known
        and row.free <= best.free
        and best.cosines.get(row.label, 0.0) > SIMILAR
        and not same_family(best, row)
        and floor.ratio(row.fitted.held_out) ** 2 < most
        and floor.reached(row.fitted.held_out)
    )


def _is_simple_enough(best: Ranked, row: Ranked) -> bool:
    """Whether it needs no more parameters than the best and refines no effect of its class."""
    known = {best.effect, *(name.split("@")[0] for name in best.alike)}
    return row.free <= best.free and row.placement.effect.refines not in known


def equal(one: Ranked, other: Ranked, cosine: float) -> bool:
    """Whether one is not better than another beyond chance, held out; if the other is not fitted,
    whether they are parallel.
    """
    if other.fitted is None:
        return cosine > SAME
    assert one.fitted is not None
    if not other.accepted:
        return False
    ratio = error_ratio(one, other)
    if abs(ratio - 1) < NO_DIFFERENCE:
        return True
    # One that is materially ahead was passed over for its parameters: it is named next.
    return bool(lead(one, other) < EQUAL and ratio > 1 - MATERIAL)


def lead(one: Ranked, other: Ranked) -> float:
    """Paired held-out difference in standard deviations; positive if `one` is better."""
    assert one.fitted is not None
    assert other.fitted is not None
    difference = block_differences(other.fitted.held_out, one.fitted.held_out)
    spread = difference.std(ddof=1) / np.sqrt(len(difference))
    return float(difference.mean() / max(spread, 1e-300))
