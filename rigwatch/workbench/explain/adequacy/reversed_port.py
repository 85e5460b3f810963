"""A force port that a model has with the wrong sign.

A force port takes what acts on the moving part. Where the model subtracts it and should add it, or
the other way round, friction there would drive. No effect may do so, and others that explain a part
of the error would be named in its place.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import Ranked, left_over, rank_all

MOST = 0.9
"""Share of the training error above noise that an effect of the wrong sign explains."""
FAR = 0.75
"""Share of the training error's energy that is above noise, at least: it is twice the noise."""
LITTLE_LEFT = 0.25
"""Share that an effect of the right sign leaves at most where no port is suspected."""
SAID = (
    "{label} would explain {share:.0%} of the training error if its sign were the other one, so"
    " port {port} may have the wrong sign in the model: a force port takes what acts on the moving"
    " part, so add it to the forces of an equation of motion, and subtract it where an output is"
    " the reaction"
)


def with_reversed_port(bench: Bench, rows: Sequence[Ranked], verdict: Verdict) -> Verdict:
    """The verdict; `unknown_effect` if what is missing suits a force port of the other sign.

    Args:
        bench: the study.
        rows: the ranking that the verdict is on.
        verdict: stays as it is along a measured motion, and where what it names explains the error.
    """
    if bench.data.along_motion or bench.study.model.rough or not _leaves_much(bench, verdict):
        return verdict
    found = _of_the_other_sign(bench, rows)
    if found is None:
        return verdict
    said = SAID.format(label=found.label, share=min(found.explained, 1.0), port=found.port)
    return replace(verdict, word="unknown_effect", text=f"{verdict.text}; but {said}")


def _leaves_much(bench: Bench, verdict: Verdict) -> bool:
    """Whether an effect is missing, and what is named leaves much of the error."""
    if verdict.word in {"nothing_missing", "model_inadequate"} or verdict.second or verdict.beside:
        return False
    best = verdict.best
    if best is None or best.fitted is None or not best.accepted:
        return True
    return left_over(bench.base, best, bench.floor) > LITTLE_LEFT


def _of_the_other_sign(bench: Bench, rows: Sequence[Ranked]) -> Ranked | None:
    """The effect at a force port that explains most, if only its bounds are against it."""
    above = bench.floor.of_training.above(bench.base.train)
    if above < FAR:
        return None
    allowed = {row.label for row in rows}
    every = rank_all(bench.study, bench.data, bench.base)
    found = [row for row in every if row.kind == "force" and row.label not in allowed]
    best = max(found, key=lambda row: row.explained, default=None)
    return best if best is not None and best.explained >= MOST * above else None
