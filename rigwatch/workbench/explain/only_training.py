"""Effects that the training asks for although the recordings held out hardly show them.

The recordings held out may not move the machine so that an effect shows, as a level that stays
below the overflow of a tank. Nothing of them is missing then, and yet the training is not noise:
they cannot tell.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.credibility import apparent_when_healthy
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import MATERIAL, Ranked
from rigwatch.workbench.study import told

SHOWN = 1e-3
"""p-value, corrected for the number of candidates, of an effect that the training shows."""


def undetermined_if_training_asks(
    bench: Bench, rows: Sequence[Ranked], verdict: Verdict
) -> Verdict:
    """The verdict; `undetermined` if the training asks for an effect where nothing held out does.

    Along a measured motion, of a rough model and once effects are accepted, the model's own error
    does so as well: a slider has rounded corners. There the sentence says it, and the word stays.

    Args:
        bench: the study.
        rows: the ranking that the verdict is on.
        verdict: of which only `nothing_missing` may change.
    """
    if verdict.word != "nothing_missing":
        return verdict
    row = asked_by_training(bench.base, rows)
    # What the healthy recording shows as strongly is not missing since.
    while row is not None and apparent_when_healthy(bench, row):
        rows = [other for other in rows if other is not row]
        row = asked_by_training(bench.base, rows)
    if row is None:
        return verdict
    text = verdict.text + _in_words(bench.base, row)
    if bench.data.along_motion or bench.study.model.rough or bench.base.placements:
        return replace(verdict, text=text)
    return Verdict("undetermined", row, (row.label, *row.alike), (), text)


def asked_by_training(base: Fitted, rows: Sequence[Ranked]) -> Ranked | None:
    """The effect that leaves least of the training, of those that it shows; None without one.

    It is not accepted, as the recordings held out do not show it.
    """
    asked = [row for row in rows if not (row.accepted or row.vague) and _asked_for(base, row)]
    return min(asked, key=_train_error, default=None)


def _asked_for(base: Fitted, row: Ranked) -> bool:
    """Whether it lowers the training error beyond chance, and materially."""
    lower = _train_error(row) < (1 - MATERIAL) * base.train_error
    return lower and row.p_value < SHOWN


def _train_error(row: Ranked) -> float:
    return row.fitted.train_error if row.fitted is not None else float("inf")


def _in_words(base: Fitted, row: Ranked) -> str:
    before, after = (told(each, base.told_in) for each in (base.train_error, _train_error(row)))
    alike = f" (or {', '.join(row.alike)})" if row.alike else ""
    return (
        f"; but {row.label}{alike} lowers the error of the training from {before:.3g} to"
        f" {after:.3g} {base.told_in}, which the recordings held out hardly show: hold out one that"
        " moves the machine as the training does"
    )
