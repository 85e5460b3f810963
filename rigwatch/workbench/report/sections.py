"""The report's sections: what a study's numbers are in words, tables and pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from rigwatch.page import exact, figure, key, limits, table
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Region
from rigwatch.workbench.explain import Explanation, Row
from rigwatch.workbench.report import charts
from rigwatch.workbench.report.text_report import VERDICTS, doubt_of
from rigwatch.workbench.steps import Signals, Stage
from rigwatch.workbench.study import Study

VIEWS = {
    "direction": "direction of motion",
    "amplitude": "distance from the mean position",
    "time": "time [s]",
}


@dataclass(frozen=True, eq=False)
class Material:
    """All that a report is made from.

    Attributes:
        study: what it is about.
        stages: the model with no effect, with the first, …, as it is.
        signals: measured and modelled on the recordings held out, of each stage.
        explanation: ranking and verdict for the model as it is.
        before, now: where the model alone and the model as it is fail, in training.
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
        """Effects that held-out data spoke against, where what stood then stands still."""
        labels = [stage.added for stage in self.stages[1:]]
        found: dict[tuple[str, int], charts.Refused] = {}
        for line in self.ledger:
            error, stood = line.get("tried_held_out_error"), line.get("effects", [])
            if error is not None and stood == labels[: len(stood)]:
                label = f"{line['effect']}@{line['port']}"
                found[label, len(stood)] = charts.Refused(label, len(stood), error)
        return list(found.values())


def header(m: Material) -> str:
    """The verdict in plain words, and the figures that matter."""
    first, last = m.stages[0].comparison, m.stages[-1].comparison
    unit = escape(last.unit)
    cards = [
        (exact(first.held_out_error), f"held-out error of the model alone [{unit}]"),
        (exact(last.held_out_error, "held_out_error"), f"held-out error now [{unit}]"),
        (exact(last.train_error, "train_error"), f"training error now [{unit}]"),
        (exact(last.noise_floor, "noise_floor"), f"noise floor [{unit}]"),
    ]
    name = m.study.folder.resolve().name
    figures = "".join(f'<div class="figure"><b>{n}</b><span>{w}</span></div>' for n, w in cards)
    return (
        f'<p class="kicker">{escape(name)} · {escape(m.study.model.name)}</p>'
        f'<h1 id="verdict" data-verdict="{m.explanation.verdict}">{escape(_headline(m))}</h1>'
        f"<p>{escape(_story(m))}</p><p>{escape(_sentence(doubt_of(m.explanation)))}</p>"
        f'<p class="sub">{escape(m.study.model.summary)} Noise floor from'
        f' {escape(last.noise_from)}.</p><div class="figures">{figures}</div>'
    )


def _headline(m: Material) -> str:
    """What a reader takes along: how far the error fell, and what is missing still."""
    first, last = m.stages[0].comparison, m.stages[-1].comparison
    best = m.explanation.ranking[0] if m.explanation.ranking else None
    name = f"{_plain(best.effect)} at {best.port}" if best else ""
    rivals = " or ".join(_plain(rival.split("@")[0]) for rival in m.explanation.rivals)
    words = {
        "nothing_missing": "nothing is missing",
        "missing_effect": f"probably missing: {name}",
        "undetermined": f"this recording cannot tell {name} from {rivals}",
    }.get(m.explanation.verdict, VERDICTS[m.explanation.verdict])
    if m.explanation.also:
        words = m.explanation.text
    if len(m.stages) == 1:
        return words[0].upper() + words[1:]
    fall = f"Error {first.held_out_error:.3g} → {last.held_out_error:.3g} {last.unit}"
    still = words.replace("probably", "probably still", 1)
    return f"{fall} on unseen data; {still}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _plain(effect: str) -> str:
    return effect.replace("_", " ")


def _listed(m: Material) -> str:
    names = [stage.added.split("@")[0].replace("_", " ") for stage in m.stages[1:]]
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _story(m: Material) -> str:
    first, last = m.stages[0].comparison, m.stages[-1].comparison
    verdict = f"Verdict on the model as it is: {m.explanation.text}."
    if len(m.stages) == 1:
        return verdict
    return (
        f"The error on recordings that no fit has seen fell from {first.held_out_error:.3g} to"
        f" {last.held_out_error:.3g} {last.unit} as {_listed(m)} came into the model. {verdict}"
    )


def errors(m: Material) -> str:
    """Errors step by step."""
    picture = charts.error_chart(m.stages, m.refused)
    rows = []
    for stage in m.stages:
        c = stage.comparison
        physics = m.study.effects[stage.added.split("@")[0]].physics if stage.added else ""
        rows.append(
            [
                escape(stage.added or "model alone"), exact(c.train_error), exact(c.held_out_error),
                exact(c.noise_floor), escape(physics),
            ]
        )  # fmt: skip
    legend = key(
        ("held", "held out"), ("train", "training"), ("floor", "noise floor"),
        ("refused", "refused (hollow)"),
    )  # fmt: skip
    head = ["step", "training", "held out", "noise floor", "what it is"]
    channels = [
        [
            escape(name), exact(c.train_error, f"{name}.train_error"),
            exact(c.held_out_error, f"{name}.held_out_error"),
            exact(c.noise_floor, f"{name}.noise_floor"), escape(c.unit),
        ]
        for name, c in m.stages[-1].comparison.channels.items()
    ]  # fmt: skip
    per_channel = table(["channel, now", "training", "held out", "noise floor", "unit"], channels,
                        (1, 2, 3))  # fmt: skip
    return figure(picture) + legend + table(head, rows, (1, 2, 3)) + per_channel


def measured(m: Material) -> str:
    """Measured against modelled before and after each accepted effect."""
    parts = [
        key(("measured", "measured"), ("model", "modelled"), ("rest", "residual")),
        '<p class="note">Recordings held out; the stretch where the error fell most. All steps'
        " share their axes.</p>",
    ]
    for channel, (name, output) in enumerate(m.study.model.outputs.items()):
        axis = f"{name} [{output.unit}]"
        part = charts.stretch(m.signals[0], m.signals[-1], channel)
        shown = [s.measured[part, channel] for s in m.signals[:1]]
        shown += [s.modelled[part, channel] for s in m.signals]
        ends = limits(*shown)
        rest = _without_spikes([s.residual[part, channel] for s in m.signals])
        for stage, found in zip(m.stages, m.signals, strict=True):
            error = stage.comparison.channels[name].held_out_error
            heading = f"{stage.label}: {name}, {error:.3g} {output.unit} over the whole recording"
            parts += [f"<h3>{escape(heading)}</h3>"]
            parts += [figure(charts.signal_chart(found, channel, part, axis, ends))]
            parts += [figure(charts.residual_chart(found, channel, part, output.unit, rest))]
    return "".join(parts)


def _without_spikes(residuals: Sequence[FloatArray]) -> tuple[float, float]:
    """Ends of the axis that all steps share; a few spikes may stand out of it."""
    usual = [np.nanquantile(r, [0.01, 0.99]) for r in residuals if np.isfinite(r).any()]
    return limits(*usual, room=0.25)


def where(m: Material) -> str:
    """Where-maps: motion, direction, amplitude, time, frequency."""
    parts = [
        key(("before", "model alone"), ("held", "model as it is"), ("plus", "mean above 0"),
            ("minus", "below 0")),
        '<p class="note">Residual of the training recordings, as rigwatch locate counts it.</p>',
    ]  # fmt: skip
    first, last = m.stages[0], m.stages[-1]
    for channel, (name, output) in enumerate(m.study.model.outputs.items()):
        parts.append(f"<h3>{escape(name)}</h3>")
        most = charts.surface_peak(first, channel)
        maps = [charts.surface_chart(s, channel, most, output.unit) for s in (first, last)]
        words = ("model alone", "model as it is")
        drawn = [figure(p, w) for p, w in zip(maps, words, strict=True) if p]
        if drawn:
            parts.append(f'<div class="pair">{"".join(drawn)}</div>')
            scale = f"Full colour from {most:.3g} {output.unit} of mean residual in a cell on."
            parts.append(f'<p class="note">{escape(scale)}</p>')
        parts += _bars(m, name, output.unit)
        parts.append(
            figure(
                charts.spectrum_chart(first, last, channel, output.unit),
                "Spectral density of the residual",
            )
        )
    return "".join(parts)


def _bars(m: Material, channel: str, unit: str) -> list[str]:
    floor = m.stages[-1].comparison.channels[channel].noise_floor
    pair, wide = list[str](), list[str]()
    for view, words in VIEWS.items():
        old, new = ([r for r in found if (r.channel, r.view) == (channel, view)]
                    for found in (m.before, m.now))  # fmt: skip
        if not old:
            continue
        old = sorted(old, key=_order)
        picture = figure(charts.bars_chart(old, new, floor, words, unit), f"By {words}")
        (wide if len(old) > 6 else pair).append(picture)
    both = [f'<div class="pair">{"".join(pair)}</div>'] if pair else []
    return both + wide


def _order(region: Region) -> tuple[float, str]:
    words = [w for w in region.name.replace("|x - mean|", "").split() if w[0].isdigit()]
    return (float(words[0]) if words else 0.0), region.name


def ranking(m: Material) -> str:
    """What may be missing still, and why rivals were not taken."""
    found = m.explanation
    rows = [_ranked(row) for row in found.ranking]
    head = ["effect@port", "training", "held out", "p", "decision", "cannot be told from"]
    top, rest = rows[:10], rows[10:]
    parts = [
        f'<p class="note">{escape(found.text)}. {len(rows)} effects at ports were scored along the'
        " model as it is; p is corrected for that number. Errors stand where a full fit was worth"
        " it.</p>",
        table(head, top, (1, 2, 3)),
    ]
    if rest:
        more = table(head, rest, (1, 2, 3))
        parts.append(f"<details><summary>{len(rest)} more</summary>{more}</details>")
    if m.refused:
        tried = [
            [escape(r.label), exact(r.held_out_error),
             exact(m.stages[r.after].comparison.held_out_error), '<span class="no">refused</span>']
            for r in m.refused
        ]  # fmt: skip
        parts.append("<h3>Tried, and refused on the recordings held out</h3>")
        parts.append(table(["effect@port", "held out with it", "without it", ""], tried, (1, 2)))
    if found.next_experiment:
        parts.append(f"<h3>Next experiment</h3><p>{escape(found.next_experiment.text)}</p>")
    return "".join(parts)


def _ranked(row: Row) -> list[str]:
    p = "&lt; 1e-6" if row.p_value < 1e-6 else f"{row.p_value:.1g}"
    kind = "good" if row.accepted else "no"
    words = "accepted" if row.accepted else row.reason
    decision = f'<span class="{kind}">{escape(words)}</span>'
    return [
        escape(f"{row.effect}@{row.port}"), exact(row.train_error), exact(row.held_out_error), p,
        decision, escape(", ".join(row.class_)),
    ]  # fmt: skip


def parameters(m: Material) -> str:
    """Values with intervals."""
    rows = []
    for name, v in m.stages[-1].comparison.parameters.items():
        ends = "held" if v.interval is None else f"{v.interval[0]:.4g} … {v.interval[1]:.4g}"
        note = f'<span class="warn">{escape(v.note)}</span>'
        whisker = charts.interval_chart(v.value, v.interval)
        rows.append([f"<code>{escape(name)}</code>", exact(v.value, name), ends,
                     escape(v.unit.strip("()")), whisker, note])  # fmt: skip
    head = ["parameter", "value", "95 % interval", "unit", "−50 % to +50 %", ""]
    words = "Intervals hold where residuals hang together: whole blocks vary, not samples."
    return f'<p class="note">{words}</p>{table(head, rows, (1, 2))}'


def ledger(m: Material) -> str:
    """Every step, with what it stood on."""
    rows = [
        [
            escape(str(line.get("time", ""))), escape(str(line.get("step", ""))),
            escape(f"{line['effect']}@{line['port']}" if "effect" in line else ""),
            exact(line.get("train_error")), exact(line.get("held_out_error")),
            escape(str(line.get("reason", ""))),
        ]
        for line in m.ledger
    ]  # fmt: skip
    head = ["time", "step", "effect", "training", "held out", "why"]
    hashes = dict(m.ledger[-1].get("data", {})) if m.ledger else {}
    data = [[f"<code>{escape(n)}</code>", f"<code>{escape(h)}</code>"] for n, h in hashes.items()]
    if m.ledger:
        data.append(["model and effects", f"<code>{escape(m.ledger[-1]['model'])}</code>"])
    words = f"rigwatch study replay {m.study.folder} fits every step again and compares."
    return (
        f'<p class="note">{escape(words)}</p>{table(head, rows, (3, 4))}'
        f"<details><summary>SHA-256 of what the last step stood on</summary>"
        f"{table(['file', 'SHA-256'], data)}</details>"
    )
