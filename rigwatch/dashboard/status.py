"""The verdict in words, as Markdown: is there a fault, what is it probably, what to do, and how far to trust it.

Made so that the first line answers the question that people walk up to the screen with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rigwatch.dashboard.alarm_book import AlarmBook, title
from rigwatch.dashboard.palette import VERDICTS
from rigwatch.wire.messages import Alarm, Health


@dataclass(slots=True)
class Facts:
    """What the status text is made of.

    Attributes:
        rig: the rig's id.
        book: states of the alarms.
        health: last health message of each process, by source.
        figures: last value of each estimated figure, by column name.
        latency_ms: now, mean, worst: from the sample's time stamp to its arrival here [ms]; None where not live.
        skipped: messages that the dashboard left out because it was slow.
        samples: samples drawn.
        model: name of the model in use, "" where unknown.
    """

    rig: str
    book: AlarmBook
    health: dict[str, Health] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)
    latency_ms: tuple[float, float, float] | None = None
    skipped: int = 0
    samples: int = 0
    model: str = ""

    def verdict(self) -> str:
        """The verdict as one of `palette.VERDICTS`."""
        if faults := self.book.faults():
            name = faults[0].name.partition(".")[0]
            return name if name in VERDICTS else "fault"
        if self.book.unseen():
            return "over"
        if self.book.remarks():
            return "no_verdict"
        return "healthy" if self.figures else "waiting"


def markdown(facts: Facts) -> str:
    """The whole text."""
    return "\n\n".join(part for part in (_verdict(facts), _table(facts), _processes(facts)) if part)


def _verdict(facts: Facts) -> str:
    faults, remarks, unseen = facts.book.faults(), facts.book.remarks(), facts.book.unseen()
    if faults:
        return _fault(faults[0], faults[1:])
    if facts.samples == 0:
        return "# Waiting for samples\n\nNo sample has arrived yet."
    if unseen:
        text = _sentence(unseen[0].cause)
        return (
            f"# Over, not yet seen: {title(unseen[0].name)}\n\n{text} Acknowledge it to clear this."
        )
    if remarks:
        return f"# No verdict just now\n\n{_sentence(remarks[0].cause)} {remarks[0].guidance}"
    if not facts.figures:
        return "# No estimates yet\n\nSamples arrive, the monitor has not said anything about them."
    return "# Healthy\n\nThe rig moves as its model says: no sign of friction."


def _fault(worst: Alarm, others: Sequence[Alarm]) -> str:
    lines = [f"# {title(worst.name).upper()}", f"{_sentence(worst.cause)}", f"**{worst.guidance}**"]
    if others:
        lines.append("Also: " + "; ".join(title(alarm.name) for alarm in others[:4]) + ".")
    return "\n\n".join(lines)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _table(facts: Facts) -> str:
    rows = [*_counter_rows(facts.health)]
    if facts.latency_ms:
        rows.append(_row("latency to this screen [ms]", *facts.latency_ms))
    if not rows:
        return ""
    return "\n".join(["| | now | mean | worst |", "|---|---:|---:|---:|", *rows])


def _counter_rows(health: Mapping[str, Health]) -> list[str]:
    """Rows of the counters that every process may report; `_mean` and `_worst` join their counter."""
    rows = []
    for source in sorted(health):
        counters = health[source].counters
        for name, value in counters.items():
            if name.rpartition("_")[2] in ("mean", "worst") or _companion(name, counters):
                continue
            mean, worst = counters.get(_with(name, "mean")), counters.get(_with(name, "worst"))
            rows.append(_row(f"{source}: {_words(name)}", value, mean, worst))
    return rows


def _companion(name: str, counters: Mapping[str, float]) -> bool:
    """Whether the counter is the mean or the worst of another one, such as `rate_mean_hz`."""
    for word in ("_mean", "_worst"):
        if word in name and name.replace(word, "", 1) in counters:
            return True
    return False


def _with(name: str, word: str) -> str:
    stem, _, unit = name.rpartition("_")
    return f"{stem}_{word}_{unit}" if unit in ("hz", "ms", "us") else f"{name}_{word}"


def _words(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    shown = {"hz": "Hz", "ms": "ms", "us": "µs", "ppm": "ppm"}.get(unit)
    return f"{stem.replace('_', ' ')} [{shown}]" if shown else name.replace("_", " ")


def _row(label: str, now: float, mean: float | None = None, worst: float | None = None) -> str:
    return f"| {label} | {_figure(now)} | {_figure(mean)} | {_figure(worst)} |"


def _figure(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.4g}"


def _processes(facts: Facts) -> str:
    ill = [h for _, h in sorted(facts.health.items()) if h.text]
    lines = [f"* {h.source}: {h.state}, {h.text}" for h in ill]
    if facts.skipped:
        lines.append(f"* this screen skipped {facts.skipped} messages to keep up")
    return "\n".join(lines)
