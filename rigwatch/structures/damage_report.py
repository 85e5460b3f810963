"""An examination as one web page: no scripts, nothing from the network, readable on paper."""

from collections.abc import Iterator, Mapping
from html import escape
from math import isnan

from rigwatch.structures.damage import Damage, Examination
from rigwatch.structures.damage_drawing import ranking_svg, residual_svg, statistic_svg
from rigwatch.structures.damage_reference import Figure
from rigwatch.structures.damage_signals import loudest
from rigwatch.structures.description import label
from rigwatch.structures.locate import Candidate

SHOWN = 8

STYLE = """
:root { color-scheme: light dark; --ink: #1c2430; --quiet: #5a6472; --grid: #dfe3e8;
  --line: #2f6db3; --mark: #c2571a; --faint: #b9c4d0; --ground: #ffffff; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ee; --quiet: #9aa5b3; --grid: #323a45;
  --line: #6aa9ec; --mark: #f0935a; --faint: #566272; --ground: #161b22; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--ground);
  max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem } h2 { font-size: 1.15rem; margin-top: 2.2rem }
table { border-collapse: collapse; margin: .8rem 0 }
caption { text-align: left; color: var(--quiet) }
td, th { padding: .2rem .9rem .2rem 0; text-align: right; font-variant-numeric: tabular-nums }
td:first-child, th:first-child, td.words { text-align: left }
th { font-weight: 600; border-bottom: 1px solid var(--grid) }
svg { width: 100%; font-size: 12px } svg text { fill: var(--ink) } svg .quiet { fill: var(--quiet) }
svg .grid { stroke: var(--grid) } svg .marked { fill: var(--mark) }
svg .level, svg .instant { stroke: var(--mark); fill: none } svg .level { stroke-dasharray: 6 4 }
"""


def page(found: Examination, record: str) -> str:
    """The examination of the record called `record` as an HTML document."""
    name = found.reference.model.structure.name
    body = "\n".join(_body(found, record))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(name)}: damage</title><style>{STYLE}</style></head>\n"
        f"<body>\n{body}\n</body></html>\n"
    )


def _body(found: Examination, record: str) -> Iterator[str]:
    base = found.reference
    yield f"<h1>{escape(base.model.structure.name)}: {escape(verdict(found))}</h1>"
    yield (
        f"<p>Record {escape(record)}: {len(base.model) * base.model.dt:g} s of"
        f" {escape(', '.join(base.model.signals))} every {base.model.dt:g} s. Its first"
        f" {base.samples * base.model.dt:g} s are taken as undamaged."
        f" {escape(_rule(found))}{escape(remark(found))}</p>"
    )
    yield "<h2>Residual</h2>"
    yield statistic_svg(found)
    yield residual_svg(found, loudest(found))
    for number, damage in enumerate(found.damages, start=1):
        yield from _damage(number, damage, found)
    if base.figures:
        yield "<h2>Undamaged structure</h2>"
        yield _figures("identified from the undamaged start", base.figures, None)


def verdict(found: Examination) -> str:
    """The result in a few words."""
    if not found.damages:
        return "no damage"
    places = [
        f"{d.ranking.best.spring} {d.ranking.best.words} at {d.instant.time:.3f} s"
        if d.explained
        else f"a damage at {d.alarm:.3f} s that no change of one spring explains"
        for d in found.damages
    ]
    return "; ".join(places)


def remark(found: Examination) -> str:
    """What a reader has to know of the sensors, empty where every position was measured."""
    model = found.reference.model
    nodes = [label("x", node) for node in model.structure.nodes]
    hidden = [name for name in nodes if name not in model.signals]
    if not hidden:
        return ""
    return (
        f" The positions {', '.join(hidden)} were not measured: large changes that move them are"
        " noticed, but located less surely."
    )


def _rule(found: Examination) -> str:
    if found.settings.limit is not None:
        return f"An alarm is a residual beyond {found.settings.limit:g}, the limit that was set."
    share = 100 * found.settings.rate
    return (
        "An alarm is a cumulative sum of squared residuals beyond a threshold that noise alone"
        f" reaches in {share:g} % of such records."
    )


def _damage(number: int, damage: Damage, found: Examination) -> Iterator[str]:
    best, at = damage.ranking.best, damage.instant
    yield f"<h2>Damage {number}: {escape(best.spring)} {escape(best.words)}</h2>"
    yield (
        f"<p>Happened at {at.time:.3f} s (95 % interval {at.low:.3f} to {at.high:.3f} s), noticed"
        f" at {damage.alarm:.3f} s, identified from the data up to {damage.until:.3f} s."
        f" {escape(_class(best))}{escape(_doubt(damage))}{escape(_blind(damage, found))}</p>"
    )
    yield ranking_svg(damage.ranking)
    yield _places(damage)
    yield _figures("coefficients, with 95 % intervals", damage.figures, damage.before)


def _class(best: Candidate) -> str:
    if not best.alike:
        return "No other change of a single spring looks like it in this record."
    return f"This record cannot tell it from a change of {', '.join(best.alike)}."


def _doubt(damage: Damage) -> str:
    if damage.explained:
        return ""
    return " No change of one spring explains the data; the figures below are not to be trusted."


def _blind(damage: Damage, found: Examination) -> str:
    weak = damage.ranking.unseen
    total = len(found.reference.model.structure.springs)
    if not weak:
        return f" The data would show a tenth of stiffness lost at any of the {total} springs."
    return f" They would not show a tenth of stiffness lost at {', '.join(weak)}."


def _places(damage: Damage) -> str:
    rows = "".join(
        f"<tr><td>{escape(c.name)}</td><td class=words>{escape(c.words)}</td>"
        f"<td>{c.before:.5g}</td><td>{c.after:.5g}</td><td>{_number(c.deviation)}</td><td>{c.score:.4g}</td>"
        f"<td>{_chance(c.p_value)}</td><td>{_number(c.chi2)}</td></tr>"
        for c in damage.ranking.candidates[:SHOWN]
    )
    return (
        f"<table><caption>places, best of {len(damage.ranking.candidates)} first; p by chance"
        " as the best of all</caption><tr><th>coefficient</th><th>means</th><th>before</th>"
        f"<th>after</th><th>±</th><th>score</th><th>p</th><th>χ²/f left</th></tr>{rows}</table>"
    )


def _figures(caption: str, after: Mapping[str, Figure], before: Mapping[str, Figure] | None) -> str:
    heads = "<th>before</th><th>after</th>" if before else "<th>value</th>"
    rows = []
    for name, figure in after.items():
        old = f"<td>{_with_interval(before[name])}</td>" if before else ""
        rows.append(f"<tr><td>{escape(name)}</td>{old}<td>{_with_interval(figure)}</td></tr>")
    return (
        f"<table><caption>{escape(caption)}</caption><tr><th>coefficient</th>{heads}</tr>"
        f"{''.join(rows)}</table>"
    )


def _with_interval(figure: Figure) -> str:
    if isnan(figure.low):
        return f"{figure.value:.6g} (known)"
    return f"{figure.value:.6g} [{figure.low:.6g}, {figure.high:.6g}]"


def _chance(value: float) -> str:
    return f"{value:.2g}" if value > 1e-300 else "< 1e-300"


def _number(value: float) -> str:
    return "" if isnan(value) else f"{value:.3g}"
