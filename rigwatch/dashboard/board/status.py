"""The verdict as Markdown: is there a fault, what is it probably, what to do, how certain.

The first line answers the question that brings people to the screen.
"""

from collections.abc import Iterator, Mapping, Sequence

from rigwatch.dashboard.board.alarm_book import title
from rigwatch.dashboard.board.facts import Facts
from rigwatch.wire.bus import shelf_line
from rigwatch.wire.messages import Alarm

_UNITS = {"hz": "Hz", "ms": "ms", "us": "µs", "ppm": "ppm", "s": "s"}
_ESTIMATES = (("theta1", "Coulomb θ1"), ("theta2", "viscous θ2"))
_ESTIMATE_HEAD = "| | now | thresholds | friction |"
_COUNTER_HEAD = "| | now | mean | worst |"
_ENDS = ("low", "high", "signature")

_CALM = {
    "waiting": ("# No estimates yet", "Samples arrive, but no estimate from the monitor yet."),
    "learning": ("# Learning", "The monitor is learning the healthy reference of this run."),
    "no_verdict": ("# No verdict now", "Too little motion to see friction. Move the rig."),
    "healthy": ("# Healthy", "The rig moves as its model says. Nothing to do."),
}
_ALWAYS = ("rate_hz", "lost_samples", "crc_errors")
_WHEN_NOT_ZERO = ("lost", "recovered", "skipped", "dropped", "reconnects", "restarts", "rejected")


def advice(facts: Facts) -> str:
    """Is there a fault, what is it probably, and what to do."""
    return _paragraphs(*_verdict(facts), _table(_ESTIMATE_HEAD, [*_friction_rows(facts)]))


def status(facts: Facts) -> str:
    """How reliable the verdict is: counters of the processes, and their warnings."""
    rows = [*_counter_rows(facts)]
    if facts.age.known:
        rows.append(
            _row("age of newest sample [ms]", facts.age.now, facts.age.mean, facts.age.worst)
        )
    complaints = [f"* {h.source}: {h.state}, {h.text}" for h in facts.health.values() if h.text]
    complaints += [f"* cleared, not acknowledged: {title(a.name)}" for a in facts.book.unseen()]
    complaints += [f"* {shelf_line(one)}" for one in facts.shelf]
    if facts.skipped:
        complaints.append(f"* this screen skipped {facts.skipped} messages to keep up")
    if facts.lost_alarms:
        complaints.append(f"* {facts.lost_alarms} alarms never reached this screen")
    return _paragraphs(_model(facts), _table(_COUNTER_HEAD, rows), "\n".join(complaints))


def _verdict(facts: Facts) -> Iterator[str]:
    faults, remarks, unseen = facts.book.faults(), facts.book.remarks(), facts.book.unseen()
    verdict = facts.verdict()
    if faults:
        yield from _fault(faults[0], faults[1:])
        if text := facts.book.missing.get(faults[0].name):
            yield _sentence(text)
    elif facts.samples == 0:
        yield from (f"# Waiting for {facts.rig}", "No sample has arrived yet.")
    elif verdict == "stale":
        yield "# NO SAMPLES"
        yield f"Nothing for {facts.silent_s:.0f} s. What is drawn is old: check daq and its line."
    elif verdict == "unwatched":
        yield "# NOT WATCHED"
        yield (
            f"Samples come, but for {facts.unwatched_s:.0f} s no estimate: the monitor has ended or"
            " hangs. Start `rigwatch monitor`, or `rigwatch up`."
        )
    elif verdict == "over":
        yield f"# Cleared: {title(unseen[0].name)}"
        yield f"{_sentence(unseen[0].cause)} The alarm has cleared by itself; acknowledge it."
    elif remarks:
        yield from ("# No verdict now", _sentence(remarks[0].cause), remarks[0].guidance)
    else:
        yield from _CALM[verdict]


def _table(head: str, rows: Sequence[str]) -> str:
    return "\n".join([head, "|---|---:|---:|---:|", *rows]) if rows else ""


def _model(facts: Facts) -> str:
    """The model, and whether it is able to judge."""
    parts = [f"model **{facts.model}**" if facts.model else "", f"{facts.samples} samples"]
    for name, yes, no in (
        ("armed", "armed", "not armed yet"),
        ("observable", "friction observable", "friction not observable"),
    ):
        if name in facts.figures and not facts.unwatched_s:
            parts.append(yes if facts.figures[name] else no)
    return ", ".join(filter(None, parts))


def _paragraphs(*parts: str) -> str:
    return "\n\n".join(part for part in parts if part)


def _fault(worst: Alarm, others: Sequence[Alarm]) -> Iterator[str]:
    yield f"# {title(worst.name).upper()}"
    yield f"**{worst.guidance}**"
    yield _sentence(worst.cause)
    if others:
        yield f"Also: {'; '.join(title(alarm.name) for alarm in others[:4])}."


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _friction_rows(facts: Facts) -> Iterator[str]:
    """The estimates beside their thresholds and the signature of the fault; none that are old."""
    for name, label in _ESTIMATES:
        if name in facts.figures and not facts.unwatched_s:
            known = (
                facts.figures.get(f"{name}_{end}", facts.marks.get(f"{name}_{end}"))
                for end in _ENDS
            )
            low, high, signature = (_figure(value, 2) for value in known)
            yield f"| {label} | {facts.figures[name]:.2f} | {low} … {high} | {signature} |"


def _counter_rows(facts: Facts) -> Iterator[str]:
    """One row per counter, from the process with the largest figure; the most important first."""
    found: dict[str, Mapping[str, float]] = {}
    for health in facts.health.values():
        for name, value in health.counters.items():
            if _has_row(name, value) and not _belongs_to_another(name, health.counters):
                known = found.get(name)
                if known is None or value > known[name]:
                    found[name] = health.counters
    for name in sorted(found, key=_display_order):
        mean, worst = (found[name].get(_with(name, word)) for word in ("mean", "worst"))
        yield _row(_words(name), found[name][name], mean, worst)


def _display_order(name: str) -> tuple[int, str]:
    return (_ALWAYS.index(name) if name in _ALWAYS else len(_ALWAYS)), name


def _has_row(name: str, value: float) -> bool:
    """The screen has room for the most requested figures; the Health tab has all."""
    shown = name in _ALWAYS or name.startswith("latency")
    return shown or (value != 0.0 and any(word in name for word in _WHEN_NOT_ZERO))


def _belongs_to_another(name: str, counters: Mapping[str, float]) -> bool:
    stems = (name.replace(f"_{word}", "", 1) for word in ("mean", "worst") if f"_{word}" in name)
    return any(stem in counters for stem in stems)


def _with(name: str, word: str) -> str:
    stem, _, unit = name.rpartition("_")
    return f"{stem}_{word}_{unit}" if unit in _UNITS else f"{name}_{word}"


def _words(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    text = f"{stem} [{_UNITS[unit]}]" if unit in _UNITS else name
    return text.replace("_", " ").replace("crc", "CRC")


def _row(label: str, now: float, mean: float | None = None, worst: float | None = None) -> str:
    return f"| {label} | {_figure(now)} | {_figure(mean)} | {_figure(worst)} |"


def _figure(value: float | None, digits: int = 4) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.{digits}g}"
