"""The report's sections: texts and charts for `templates/study.html`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigwatch.page import limits
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Region
from rigwatch.workbench.explain import Explanation
from rigwatch.workbench.fit import Value
from rigwatch.workbench.report import charts
from rigwatch.workbench.report.text_report import VERDICTS, at_its_bounds, doubt_of, more_missing
from rigwatch.workbench.steps import Signals, Stage
from rigwatch.workbench.study import Study

VIEWS = {
    "direction": "direction of motion",
    "amplitude": "distance from the mean position",
    "time": "time [s]",
}


@dataclass(frozen=True, eq=False)
class Material:
    """Content of a report.

    Attributes:
        study: the study.
        stages: the model without effects, with the first, …, the current model.
        signals: measured and modelled held-out outputs of each stage.
        explanation: ranking and verdict for the current model.
        before, now: training residual by region, for the model alone and the current model.
        ledger: the steps so far.
    """

    study: Study
    stages: Sequence[Stage]
    signals: Sequence[Signals]
    explanation: Explanation
    before: Sequence[Region]
    now: Sequence[Region]
    ledger: Sequence[dict[str, Any]]

    @property
    def refused(self) -> list[charts.Refused]:
        """Effects refused by held-out data while the model had effects that it still has."""
        labels = [stage.added for stage in self.stages[1:]]
        found: dict[tuple[str, int], charts.Refused] = {}
        for line in self.ledger:
            error, stood = line.get("tried_held_out_error"), line.get("effects", [])
            if error is not None and stood == labels[: len(stood)]:
                label = f"{line['effect']}@{line['port']}"
                found[label, len(stood)] = charts.Refused(label, len(stood), error)
        return list(found.values())


def headline(m: Material) -> str:
    """The heading: the fall of the error, and the effects still missing."""
    first, last = m.stages[0].comparison, m.stages[-1].comparison
    best = m.explanation.ranking[0] if m.explanation.ranking else None
    name = f"{_plain(best.effect)} at {best.port}" if best else ""
    rivals = " or ".join(_plain(rival.split("@")[0]) for rival in m.explanation.rivals)
    undecided = f"{name} from {rivals}" if rivals else f"whether {name or 'anything'} is missing"
    words = {
        "nothing_missing": "nothing is missing",
        "missing_effect": f"probably missing: {name}{more_missing(m.explanation)}"
        + at_its_bounds(m.explanation),
        "undetermined": f"this recording cannot tell {undecided}",
    }.get(m.explanation.verdict, VERDICTS[m.explanation.verdict])
    if m.explanation.also:
        words = m.explanation.text + at_its_bounds(m.explanation)
    if len(m.stages) == 1:
        return words[0].upper() + words[1:]
    fall = f"Error {first.told(first.held_out_error):.3g} → {last.told(last.held_out_error):.3g}"
    fall += f" {last.told_in}"
    still = words.replace("probably", "probably still", 1)
    return f"{fall} on unseen data; {still}"


def doubt(m: Material) -> str:
    """The reliability of the verdict, in a sentence."""
    text = doubt_of(m.explanation)
    return f"{text[0].upper()}{text[1:]}."


def _plain(effect: str) -> str:
    return effect.replace("_", " ")


def _listed(m: Material) -> str:
    names = [stage.added.split("@")[0].replace("_", " ") for stage in m.stages[1:]]
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def story(m: Material) -> str:
    """The steps taken and their result, in words."""
    first, last = m.stages[0].comparison, m.stages[-1].comparison
    verdict = f"Verdict on the current model: {m.explanation.text}."
    if len(m.stages) == 1:
        return verdict
    return (
        f"The error on held-out recordings fell from {first.told(first.held_out_error):.3g} to"
        f" {last.told(last.held_out_error):.3g} {last.told_in} as {_listed(m)} was added. {verdict}"
    )


def measured(m: Material) -> Iterator[tuple[str, str, str]]:
    """For each channel and step: heading, chart of the signals, chart of the residual."""
    for channel, (name, output) in enumerate(m.study.model.outputs.items()):
        axis = f"{name} [{output.unit}]"
        part = charts.stretch(m.signals[0], m.signals[-1], channel)
        shown = [s.measured[part, channel] for s in m.signals[:1]]
        shown += [s.modelled[part, channel] for s in m.signals]
        ends = limits(*shown)
        rest = _without_spikes([s.residual[part, channel] for s in m.signals])
        for stage, found in zip(m.stages, m.signals, strict=True):
            error = stage.comparison.channels[name].held_out_error
            yield (
                f"{stage.label}: {name}, {error:.3g} {output.unit} over the whole recording",
                charts.signal_chart(found, channel, part, axis, ends),
                charts.residual_chart(found, channel, part, output.unit, rest),
            )


def _without_spikes(residuals: Sequence[FloatArray]) -> tuple[float, float]:
    """Limits of the axis shared by all steps; a few spikes may exceed it."""
    usual = [np.nanquantile(r, [0.01, 0.99]) for r in residuals if np.isfinite(r).any()]
    return limits(*usual, room=0.25)


@dataclass(frozen=True)
class Where:
    """Where the model fails in one channel: charts by caption.

    Attributes:
        channel: its name.
        maps: mean residual by position and velocity, empty if the model has no motion.
        peak: mean residual drawn in full colour, in the channel's unit.
        narrow, wide: bar charts of half and of full page width.
    """

    channel: str
    maps: dict[str, str]
    peak: float
    narrow: dict[str, str]
    wide: dict[str, str]


def where(m: Material) -> Iterator[Where]:
    """Charts of each channel by motion, direction, amplitude, time and frequency."""
    first, last = m.stages[0], m.stages[-1]
    for channel, (name, output) in enumerate(m.study.model.outputs.items()):
        peak = charts.surface_peak(first, channel)
        drawn = {
            words: charts.surface_chart(stage, channel, peak, output.unit)
            for words, stage in (("model alone", first), ("current model", last))
        }
        maps = {words: drawing for words, drawing in drawn.items() if drawing}
        bars = {wide: _bars(m, name, output.unit, wide=wide) for wide in (False, True)}
        spectrum = charts.spectrum_chart(first, last, channel, output.unit)
        wide = bars[True] | {"Spectral density of the residual": spectrum}
        yield Where(name, maps, peak, bars[False], wide)


def _bars(m: Material, channel: str, unit: str, *, wide: bool) -> dict[str, str]:
    """Bar charts of the views that need the full page width, or of the others."""
    floor = m.stages[-1].comparison.channels[channel].noise_floor
    drawn = {}
    for view, words in VIEWS.items():
        old, new = ([r for r in found if (r.channel, r.view) == (channel, view)]
                    for found in (m.before, m.now))  # fmt: skip
        if old and wide == (len(old) > charts.NARROW):
            ordered = sorted(old, key=shown_at)
            drawn[f"By {words}"] = charts.bars_chart(ordered, new, floor, words, unit)
    return drawn


def shown_at(region: Region) -> tuple[float, str]:
    """Pieces of time as they were recorded, distances by their size, directions by their name."""
    if region.view == "time":
        return float(region.samples[0]), ""
    words = [w for w in region.name.replace("|x - mean|", "").split() if w[0].isdigit()]
    return (float(words[0]) if words else 0.0), region.name


def relative(value: Value) -> tuple[float, float] | None:
    """Ends of a parameter's interval relative to its value; None without an interval."""
    if value.interval is None or value.value == 0:
        return None
    low, high = ((end - value.value) / abs(value.value) for end in value.interval)
    return low, high


def hashes(m: Material) -> dict[str, str]:
    """SHA-256 of all inputs of the ledger's last step, by file."""
    if not m.ledger:
        return {}
    return {**m.ledger[-1].get("data", {}), "model and effects": m.ledger[-1]["model"]}
