"""State of one step of a study, read from its folder without fitting."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigwatch.browser.work import Results, results_of
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import as_kind
from rigwatch.workbench.compare import Comparison
from rigwatch.workbench.explain import Explanation, still_holds
from rigwatch.workbench.study import Study, check_data, digest, lines, open_study, refusals


@dataclass(frozen=True, eq=False)
class Step:
    """The model with the first effects of a study.

    Attributes:
        number: of effects in it.
        added: the last of them, as "effect@port"; empty for the model alone.
        comparison: its errors, None if not fitted yet.
    """

    number: int
    added: str
    comparison: Comparison | None

    @property
    def label(self) -> str:
        """Name shown to users."""
        return f"+ {self.added.split('@')[0].replace('_', ' ')}" if self.added else "model alone"


@dataclass(frozen=True, eq=False)
class State:
    """A study at one step.

    Attributes:
        study: with only the step's effects.
        name: of the study, as in the page's address.
        whole: the study with all its effects.
        step: number of effects shown.
        steps: all steps, the model alone first.
        results: of the displayed step.
        explanation: of the displayed step, None if not computed.
        evidence: for each candidate, by label.
        ledger: its lines, oldest first.
        changed: that recordings have changed since the last step, in words; empty if not.
    """

    study: Study
    name: str
    whole: Study
    step: int
    steps: list[Step]
    results: Results
    explanation: Explanation | None
    evidence: dict[str, Any]
    ledger: list[dict[str, Any]]
    changed: str = ""

    @property
    def comparison(self) -> Comparison | None:
        """Errors of the displayed step."""
        return self.steps[self.step].comparison

    @property
    def latest(self) -> bool:
        """Whether the current study is displayed."""
        return self.step == len(self.whole.file.effects)

    def plain(self) -> dict[str, Any]:
        """Data for the page's script."""
        found = self.comparison
        channels = [
            {
                "name": name,
                "unit": output.unit,
                "floor": found.channels[name].noise_floor if found else None,
            }
            for name, output in self.study.model.outputs.items()
        ]
        return {
            "study": digest(self.whole.text),
            "model": self.study.model.name,
            "key": self.results.folder.name,
            "step": self.step,
            "steps": len(self.steps),
            "latest": self.latest,
            "channels": channels,
            "fitted": found is not None and self.results.has("signals"),
            "explained": self.explanation is not None,
            "changed": self.changed,
        }


def state_of(folder: Path, name: str, step: int | None = None) -> State:
    """The study in a folder at a step; the current one if the step is None or does not exist.

    Raises:
        RigwatchError: the study cannot be opened.
    """
    whole = open_study(folder)
    effects = whole.file.effects
    count = len(effects)
    shown = count if step is None or not 0 <= step <= count else step
    models = [whole.with_effects(effects[:k]) if k < count else whole for k in range(count + 1)]
    kept = [results_of(model) for model in models]
    steps = [
        Step(k, f"{effects[k - 1].effect}@{effects[k - 1].port}" if k else "", _comparison(one))
        for k, one in enumerate(kept)
    ]
    results = kept[shown]
    explanation = _explanation(whole, results) if shown == count else _stored(results)
    return State(
        models[shown], name, whole, shown, steps, results,
        explanation,
        results.read("evidence") or {}, list(lines(whole)), _changed(whole),
    )  # fmt: skip


def _stored(results: Results) -> Explanation | None:
    told = results.read("explanation")
    return None if told is None else as_kind(told, Explanation, strict=False)


def _explanation(study: Study, results: Results) -> Explanation | None:
    """The stored explanation; None once `add` has refused what it names."""
    found = _stored(results)
    if found is None or not found.ranking:
        return found
    label = f"{found.ranking[0].effect}@{found.ranking[0].port}"
    holds = still_holds(found.verdict, label, found.beside, refusals(study))
    return found if holds else None


def _changed(study: Study) -> str:
    try:
        check_data(study)
    except ModelError as error:
        return str(error).removeprefix(f"{study.folder}: ")
    return ""


def _comparison(results: Results) -> Comparison | None:
    told = results.read("comparison")
    return None if told is None else as_kind(told, Comparison, strict=False)
