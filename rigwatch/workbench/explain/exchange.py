"""The last accepted effect, exchanged for one of its kind, if nothing beside it explains the error.

An earlier step names the simplest effect of its class, and other missing physics may have favoured
it. A spring with a slider that is moved through play leaves little that any effect beside the
slider explains; the same slider behind play does. What is found is an offer, not a verdict.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rigwatch.physics.engine.equations import Effect
from rigwatch.physics.engine.score import suits
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, bench_of, prepared, with_horizon_of
from rigwatch.workbench.fit import held_as
from rigwatch.workbench.ranking import (
    MATERIAL,
    STEP,
    Progress,
    Ranked,
    difference,
    rank_only,
    refit_nested,
    shapes_of,
)
from rigwatch.workbench.study import Study, drop_effect, told

MOST_TRIED = 10
"""Largest number of effects of a kind that are fitted in place of one."""
MUCH = 0.25
"""Share of the squared error that it must explain: where nothing else explains what is left, other
missing physics lowers the error of every refinement a little."""
LEVEL = 0.05
"""Largest probability, corrected for those tried, that chance lowers the held-out error so far."""


@dataclass(frozen=True)
class Exchange:
    """A better description of the physics that the last accepted effect stands for.

    Attributes:
        effect, port: the effect that fits better.
        instead_of: the accepted effect at that port.
        held_out_error: with the exchange, in the SI unit of the study's errors.
        p_value: one-sided, of so large a fall of the held-out error by chance; corrected for the
            number of effects tried.
    """

    effect: str
    port: str
    instead_of: str
    held_out_error: float
    p_value: float

    def text(self, unit: str, study: str) -> str:
        """The offer in words, with the commands that take it in the study's folder."""
        return (
            f"{self.effect}@{self.port} in place of {self.instead_of}@{self.port} lowers"
            f" the held-out error to {told(self.held_out_error, unit):.3g} {unit}"
            f" (rigwatch undo {study}, then rigwatch add {study} {self.effect} --port {self.port})"
        )


def exchange(bench: Bench, progress: Progress) -> Exchange | None:
    """The effect of the same kind that describes the last accepted effect better, if there is one.

    Args:
        bench: the study, its recordings and the fitted model.
        progress: called with a line of text as the fits begin.
    """
    last = bench.study.file.effects[-1]
    names = of_a_kind(bench.study, last.effect, last.port)[:MOST_TRIED]
    if not names:
        return None
    progress(f"fitting {', '.join(names)} in place of {last.effect}@{last.port}")
    try:
        rows = _fitted(_without_last(bench), names, last.port)
    except ModelError:
        return None  # the model cannot be fitted without it
    found = [(_in_place(bench, row, last.effect, len(names)), row) for row in rows if row.accepted]
    better = {row.label: each for each, row in found if each is not None}
    named = _simplest([row for row in rows if row.label in better])
    return better[named.label] if named else None


def _simplest(rows: Sequence[Ranked]) -> Ranked | None:
    """The simplest that no other betters by more than chance and a material amount."""
    return min(
        (row for row in rows if not any(_is_better(other, row) for other in rows)),
        key=lambda row: (row.free, row.held_out_error),
        default=None,
    )


def _is_better(one: Ranked, other: Ranked) -> bool:
    assert one.fitted is not None
    assert other.fitted is not None
    fall = difference(other.fitted.held_out, one.fitted.held_out)
    return fall.p_falls < STEP and fall.relative > MATERIAL


def of_a_kind(study: Study, effect: str, port: str) -> list[str]:
    """Effects that the library calls similar to one, elective or not, which suit its port.

    Those that describe it in more detail come first; those that it describes in more detail are
    contained in it, and cannot do better.
    """
    placed = {accepted.effect for accepted in study.file.effects if accepted.port == port}
    placed.update(_coarser(study, effect))
    one, place = study.effect(effect), study.model.ports[port]
    found = [
        name
        for name, other in study.effects.items()
        if name not in placed and _is_related(effect, one, name, other)
        if suits(other, place, study.model)
    ]
    return sorted(found, key=lambda name: effect not in _coarser(study, name))


def _coarser(study: Study, effect: str) -> list[str]:
    """What an effect refines, what that refines, and so on."""
    found: list[str] = []
    while (effect := study.effect(effect).refines) in study.effects and effect not in found:
        found.append(effect)
    return found


def _is_related(name: str, one: Effect, other_name: str, other: Effect) -> bool:
    likened = other_name in one.confused_with or name in other.confused_with
    return likened or other.refines == name or one.refines == other_name


def _without_last(bench: Bench) -> Bench:
    """The study without its last effect, simulated over the same horizon with the same holds."""
    before = drop_effect(bench.study)
    return bench_of(*prepared(with_horizon_of(held_as(before, bench.study.holds), bench.study)))


def _fitted(bench: Bench, names: Sequence[str], port: str) -> list[Ranked]:
    study, data, base = bench.study, bench.data, bench.base
    shapes = [shapes_of(study, data.train, name, port) for name in names]
    rows = [rank_only(study, data, base, found) for found in shapes if found]
    refit_nested(study, data, base, rows)
    return rows


def _in_place(bench: Bench, row: Ranked, instead_of: str, tried: int) -> Exchange | None:
    """The exchange for a row if both errors fall, the held-out one by more than chance."""
    assert row.fitted is not None
    fall = difference(bench.base.held_out, row.fitted.held_out)
    p_value = min(tried * fall.p_falls, 1.0)
    trained = row.fitted.train_error < bench.base.train_error
    explained = 1 - (row.held_out_error / bench.base.held_out_error) ** 2
    if not (trained and p_value < LEVEL and explained > MUCH):
        return None
    return Exchange(row.effect, row.port, instead_of, row.held_out_error, p_value)
