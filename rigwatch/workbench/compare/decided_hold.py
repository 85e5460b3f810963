"""Decides how an input acts between samples together with the first missing effect.

Before anything is known to be missing, an input that seems to act late, by half a sample as one
that is held or by a part of it, also stands for what is slow: a sensor, a winding, a filter. What
is left then speaks for another effect. So the hold is chosen once more with something slow in the
model, or with the best effect if it leaves more than noise. If both together leave less than the
best effect beside the first hold, beyond chance, all effects are ranked with the hold that belongs
to it. If both leave the same, the recordings cannot tell, and both are said.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.score import suits
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data import port_sizes, scale_of_several
from rigwatch.workbench.fit import explains_more, fit_model, may_hide_slow, with_hold_beside
from rigwatch.workbench.ranking import (
    Progress,
    Ranked,
    best_accepted,
    in_order,
    no_progress,
    rank,
    refit,
)
from rigwatch.workbench.study import Held, Study

SLOW = "lag"
"""The effect of what is slow, to first order."""
AS_WELL = (
    "{one} with {inputs} {how} and {other} with {inputs} {late} explain this recording equally well"
)


@dataclass(frozen=True, eq=False)
class Decided:
    """A study with its ranking, after its hold has been decided.

    Attributes:
        bench: with the hold decided.
        rows: the ranking with it.
        rival: label of the effect that explains as much with another hold; empty without one.
        text: the same in words.
    """

    bench: Bench
    rows: list[Ranked]
    rival: str = ""
    text: str = ""


def with_hold_decided(
    bench: Bench, rows: list[Ranked], progress: Progress = no_progress
) -> Decided:
    """The study and its ranking with the hold that leaves less beside its best effect.

    Args:
        bench: the study, whose hold may be in doubt.
        rows: its ranking.
        progress: called with a line of text as each fit begins.
    """
    as_found = Decided(bench, rows)
    best = best_accepted(rows)
    if best is None and bench.floor.reached(bench.base.held_out):
        return as_found
    if _is_undetermined(bench) or not may_hide_slow(bench.study, bench.data):
        return as_found
    progress("choosing how inputs act between samples with something slow in the model")
    beside = [*_slow_at_ports(bench), *_leaves_more(bench, best)]
    try:
        slow, study, fitted = with_hold_beside(bench.study, bench.data, bench.base, beside)
    except ModelError:
        return as_found
    left = bench.base if best is None or best.fitted is None else best.fitted
    if explains_more(fitted, left):
        return _ranked_with(_bench_of(bench, study), slow, progress) or as_found
    if best is None or best.effect == SLOW or explains_more(left, fitted):
        return as_found
    return replace(as_found, rival=slow, text=_text(bench.study, best.label, slow, study))


def _leaves_more(bench: Bench, best: Ranked | None) -> list[Placement]:
    """The best effect, if it leaves more than noise beside a hold that was chosen without it."""
    if best is None or best.fitted is None or bench.floor.reached(best.fitted.held_out):
        return []
    return [best.placement]


def _is_undetermined(bench: Bench) -> bool:
    """Whether the recordings determine none of the model's parameters."""
    ended, free = bench.base.convergence, set(bench.base.compiled.system.free)
    return ended is not None and bool(free) and free <= set(ended.undetermined)


def _slow_at_ports(bench: Bench) -> Iterator[Placement]:
    """Something slow, at each port where it may be."""
    study = bench.study
    effect, sizes = study.effects.get(SLOW), port_sizes(study.model, bench.data.train)
    if effect is None:
        return
    for port, own in study.model.ports.items():
        if suits(effect, own, study.model):
            yield Placement(SLOW, study.effect_at(SLOW, port).scaled(sizes[port]), port)


def with_hold_of(bench: Bench, placement: Placement) -> Bench | None:
    """The study with the hold that its recordings show with an effect in the model.

    None if its hold is not in doubt, or if both together leave no less than the study's hold alone.

    Args:
        bench: the study with a hold chosen without the effect.
        placement: the effect.
    """
    if not may_hide_slow(bench.study, bench.data):
        return None
    try:
        _, study, fitted = with_hold_beside(bench.study, bench.data, bench.base, [placement])
    except ModelError:
        return None
    if study.holds == bench.study.holds or not explains_more(fitted, bench.base):
        return None
    return _bench_of(bench, study)


def _bench_of(bench: Bench, study: Study) -> Bench | None:
    """The bench with the hold of another instance of its study; None if that cannot be fitted."""
    try:
        return bench_of(study, bench.data, scale_of_several(bench.data.train))
    except ModelError:
        return None


def _ranked_with(decided: Bench | None, slow: str, progress: Progress) -> Decided | None:
    """The ranking with the hold that belongs to what is slow; None without its bench."""
    if decided is None:
        return None
    study, data = decided.study, decided.data
    rows = rank(study, data, decided.base, decided.floor, progress)
    for row in rows:
        if row.label == slow and row.fitted is None and not row.failure:
            refit(study, data, decided.base, row, fit_model)
    return Decided(decided, in_order(rows))


def _text(study: Study, named: str, slow: str, other: Study) -> str:
    """What explains as much with another hold, in words."""
    changed = [name for name, held in study.holds.items() if other.holds[name] != held]
    names = changed or list(study.holds)
    return AS_WELL.format(
        one=slow,
        inputs=" and ".join(names),
        how=_how(other.holds[names[0]]),
        other=named,
        late=_how(study.holds[names[0]]),
    )


def _how(held: Held) -> str:
    if held.late:
        return f"{held.late:.2g} of a sample late"
    return "held without delay" if held.hold == "zero" else "linear between samples"
