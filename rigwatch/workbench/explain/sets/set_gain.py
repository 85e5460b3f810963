"""Whether the held-out recordings support an effect together with others, if not alone.

Of several missing effects one may lower the held-out error only once the others are in the model.
It is supported in a set of effects if each effect of the set is accepted in the model with all
others, and the whole set lowers the error of the model without any of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.sets.combination import with_rows
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import Ranked, judge_fit, rank_only, refit, shapes_of
from rigwatch.workbench.study import told


@dataclass(frozen=True)
class SetGain:
    """What the held-out recordings say of an effect together with others.

    Attributes:
        label: the effect, as "effect@port".
        others: the other effects of the set.
        without, held_out_error: of the model with the others, and with the whole set.
        reason: why the set does not support the effect; empty if it does.
        vague: whether that is only because the training does not determine the strengths, while the
            held-out error falls with each effect and with all.
    """

    label: str
    others: tuple[str, ...]
    without: float
    held_out_error: float
    reason: str
    vague: bool = False

    def text(self, unit: str) -> str:
        """The evidence in a sentence, in the unit in which errors are told."""
        errors = f"{told(self.without, unit):.4g} → {told(self.held_out_error, unit):.4g} {unit}"
        return f"with {', '.join(self.others)}: held-out error {errors}"


def set_gain(bench: Bench, label: str, others: Sequence[str]) -> SetGain:
    """Fit a set of effects, and the set without each of them, and judge.

    Args:
        bench: the study.
        label: the effect, as "effect@port".
        others: the others of the set, none of them in the model yet.

    Raises:
        ModelError: an effect does not fit its port, or a set cannot be fitted.
    """
    whole = _fitted_set(bench, [label, *others])
    errors, reasons, vague = {}, list[str](), True
    for each in whole:
        rest = _fitted_set(bench, [row.label for row in whole if row is not each])
        judged = replace(each, fitted=whole[-1].fitted, vague=False)
        judge_fit(_last(rest), judged)
        errors[each.label] = _last(rest).held_out_error
        vague = vague and (judged.accepted or judged.vague)
        if not judged.accepted:
            names = ", ".join(sorted(row.label for row in rest))
            reasons.append(f"{each.label} with {names}: {judged.reason}")
    judged = replace(whole[0], fitted=whole[-1].fitted, vague=False)
    judge_fit(bench.base, judged)
    vague = vague and (judged.accepted or judged.vague)
    if not judged.accepted:
        reasons.append(f"all together: {judged.reason}")
    found = _last(whole).held_out_error
    why = "; ".join(reasons[:1])
    return SetGain(label, tuple(others), errors[label], found, why, bool(why) and vague)


def _last(rows: Sequence[Ranked]) -> Fitted:
    found = rows[-1].fitted
    assert found is not None
    return found


def _fitted_set(bench: Bench, labels: Sequence[str]) -> list[Ranked]:
    """Effects fitted one by one, in each step the one that explains most of what is left."""
    fitted, rows, waiting = bench.base, list[Ranked](), list(labels)
    while waiting:
        study = with_rows(bench.study, rows)
        shapes = [shapes_of(study, bench.data.train, *label.split("@")) for label in waiting]
        found = [rank_only(study, bench.data, fitted, each) for each in shapes]
        row = max(found, key=lambda each: each.explained)
        refit(study, bench.data, fitted, row)
        if row.fitted is None:
            names = ", ".join(each.label for each in rows) or "the model"
            raise ModelError(f"{row.label} with {names}: cannot be fitted: {row.failure}")
        fitted, rows = row.fitted, [*rows, row]
        waiting.remove(row.label)
    return rows
