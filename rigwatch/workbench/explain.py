"""Explains the gap: ranks what may be missing, gives a verdict and says what to do next."""

import dataclasses
from dataclasses import dataclass, field

from rigwatch.workbench.calibration import seen
from rigwatch.workbench.compare import Bench, Comparison, comparison, open_bench
from rigwatch.workbench.intervals import Value, values
from rigwatch.workbench.next_experiment import Experiment, propose
from rigwatch.workbench.rank import Progress, Ranked, accepted_from, rank, refit, unheard
from rigwatch.workbench.study import Study
from rigwatch.workbench.verdict import Verdict, Word, judge

MOST_OF_THE_REST = 0.3
"""Share of what the best leaves that a second effect must explain to first order to be tried."""
ROUGHLY = 1.5
"""Error over the noise floor that two effects may leave of a rough model."""


@dataclass(frozen=True)
class Row:
    """One effect of the ranking.

    Attributes:
        effect, port: which one.
        train_error, held_out_error: with it in the model, None where it was not fitted.
        p_value: corrected for the number of candidates.
        class_: effects that it cannot be told from on this recording, as "effect@port".
        parameters: its own, by name.
        accepted: whether the held-out error falls beyond chance.
        reason: in words.
    """

    effect: str
    port: str
    train_error: float | None
    held_out_error: float | None
    p_value: float
    class_: list[str]
    parameters: dict[str, Value]
    accepted: bool
    reason: str


@dataclass(frozen=True)
class Explanation:
    """What a study learns from its recordings.

    Attributes:
        verdict: nothing_missing, missing_effect, undetermined or unknown_effect.
        text: the verdict in a sentence.
        comparison: the model as it is.
        ranking: best first.
        also: what is missing as well, where two effects hide at once.
        rivals: of different physics that the recording cannot tell from the best.
        next_experiment: what would tell them apart, None where nothing needs to be told.
        wrong_probability: of the verdict, calibrated on simulated cases.
        like_this: simulated cases with such a verdict, and how many of them were wrong.
    """

    verdict: str
    text: str
    comparison: Comparison
    ranking: list[Row]
    rivals: list[str] = field(default_factory=list)
    also: list[str] = field(default_factory=list)
    next_experiment: Experiment | None = None
    wrong_probability: float = 0.5
    like_this: tuple[int, int] = (0, 0)


def explain(study: Study, progress: Progress = unheard) -> Explanation:
    """Rank every effect at every port and judge.

    Args:
        study: the study.
        progress: told what begins.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    progress("fitting the model as it is")
    bench = open_bench(study)
    rows, verdict = ranking(bench, progress)
    return explanation(bench, rows, verdict)


def ranking(bench: Bench, progress: Progress = unheard) -> tuple[list[Ranked], Verdict]:
    """The ranking, what the verdict names in front, and the verdict."""
    rows = rank(bench.study, bench.data, bench.base, bench.floor, progress)
    verdict = judge(bench.base, rows, bench.floor)
    if verdict.word == "unknown_effect" and verdict.best is not None:
        verdict = _with_second(bench, verdict, progress)
    if verdict.best is not None:
        rows = [verdict.best, *(row for row in rows if row is not verdict.best)]
    return rows, verdict


def _with_second(bench: Bench, verdict: Verdict, progress: Progress) -> Verdict:
    """The verdict once a second effect has been tried beside the best: two may hide at once.

    The best alone may have taken the place of one that is right only beside the second; so where
    the two leave more than noise, the second is tried with every other first, too.
    """
    best = verdict.best
    assert best is not None
    progress(f"{best.label} leaves much: trying a second effect beside it")
    second = _beside(bench, best, progress)
    found = _both(bench, verdict, second)
    if found is not None or second.best is None:
        return found or verdict
    first = dataclasses.replace(second.best)
    refit(bench.study, bench.data, bench.base, first)
    if first.fitted is None:
        return verdict
    progress(f"{first.label} is trusted more: trying a second effect beside that")
    beside = _beside(bench, first, progress)
    return _both(bench, dataclasses.replace(second, best=first), beside) or verdict


def _beside(bench: Bench, first: Ranked, progress: Progress) -> Verdict:
    """The verdict on what is missing once the first has been added."""
    assert first.fitted is not None
    study = bench.study.with_effects([*bench.study.file.effects, accepted_from(first)])
    rows = rank(study, bench.data, first.fitted, bench.floor, progress, least=MOST_OF_THE_REST)
    return judge(first.fitted, rows, bench.floor)


def _enough(bench: Bench, second: Ranked) -> bool:
    """Whether two effects leave so little that they are worth naming.

    Nothing but noise, as two wrong ones together explain much. A rough model leaves more, since
    what it leaves on a healthy rig changes with the fault.
    """
    assert second.fitted is not None
    rough = bench.study.model.rough and bench.floor.ratio(second.fitted.held_out) < ROUGHLY
    return rough or bench.floor.reached(second.fitted.held_out)


def _both(bench: Bench, first: Verdict, second: Verdict) -> Verdict | None:
    """A verdict that names both; None where they do not explain enough."""
    if second.best is None or not _enough(bench, second.best):
        return None
    assert first.best is not None
    assert second.best.fitted is not None
    named = (*second.members, *second.rivals)
    certain = bench.floor.reached(second.best.fitted.held_out) and not second.rivals
    word: Word = "missing_effect" if certain else "undetermined"
    also = f"{named[0]} as well" if certain else f"probably {' or '.join(named)} as well"
    text = f"{first.best.label} is missing, and {also}"
    return dataclasses.replace(first, word=word, text=text, second=named)


def explanation(bench: Bench, rows: list[Ranked], verdict: Verdict) -> Explanation:
    """The same for people and programs."""
    members, rivals = [*verdict.members, *verdict.rivals], list(verdict.rivals)
    experiment = None
    if verdict.best is not None and rivals:
        experiment = propose(bench, verdict.best, [row for row in rows if row.label in rivals])
    told = [_row(row, members if row is verdict.best else row.alike) for row in rows]
    return Explanation(
        verdict.word,
        verdict.text,
        comparison(bench),
        told,
        rivals,
        list(verdict.second),
        experiment,
        verdict.doubt,
        seen(verdict.word, verdict.evidence),
    )


def _row(row: Ranked, alike: list[str]) -> Row:
    found: dict[str, Value] = {}
    if row.fitted is not None:
        prefix = row.placement.prefix
        every = values(row.fitted.train)
        found = {n[len(prefix) :]: v for n, v in every.items() if n.startswith(prefix)}
    others = [label for label in alike if label != row.label]
    return Row(
        row.effect,
        row.port,
        row.fitted.train_error if row.fitted else None,
        row.fitted.held_out_error if row.fitted else None,
        row.p_value,
        others,
        found,
        row.accepted,
        row.reason,
    )


def as_data(found: Explanation) -> dict[str, object]:
    """What `rigwatch explain --json` prints."""
    ranking = [
        {name.rstrip("_"): getattr(row, name) for name in row.__dataclass_fields__}
        for row in found.ranking
    ]
    whole = {name: getattr(found, name) for name in found.__dataclass_fields__}
    return whole | {"ranking": ranking}
