"""An examination as one web page: no scripts, nothing from the network, readable on paper."""

from collections.abc import Mapping
from html import escape
from math import isnan

from rigwatch.page import figure, table
from rigwatch.page import page as whole_page
from rigwatch.structures.damage import Damage, Examination, Figure, Ranking, loudest
from rigwatch.structures.model import label
from rigwatch.structures.report.damage_drawing import ranking_svg, residual_svg, statistic_svg

SHOWN = 8


def page(found: Examination, record: str) -> str:
    """The examination of the record called `record` as an HTML document."""
    name = found.reference.model.structure.name
    drawn = figure(statistic_svg(found)) + figure(residual_svg(found, loudest(found)))
    sections = [("residual", "Residual", drawn)]
    sections += [
        (f"damage{number}", f"Damage {number}: {changes(damage)}", _damage(damage, found))
        for number, damage in enumerate(found.damages, start=1)
    ]
    if figures := found.reference.figures:
        words = _figures("Identified from the undamaged start.", figures, None)
        sections.append(("undamaged", "Undamaged structure", words))
    return whole_page(f"{name}: damage", _header(found, record), sections)


def _header(found: Examination, record: str) -> str:
    base = found.reference
    name, dt = base.model.structure.name, base.model.dt
    words = (
        f"Record {record}: {len(base.model) * dt:g} s of {', '.join(base.model.signals)} every"
        f" {dt:g} s. Its first {base.samples * dt:g} s are taken as undamaged."
        f" {_rule(found)}{remark(found)}"
    )
    return (
        f'<p class="kicker">{escape(name)}</p><h1>{escape(verdict(found))}</h1>'
        f'<p class="sub">{escape(words)}</p>'
    )


def verdict(found: Examination) -> str:
    """The result in a few words."""
    if not found.damages:
        return "no damage"
    places = [
        f"{changes(d)} at {d.instant.time:.3f} s"
        if d.explained
        else f"a damage at {d.alarm:.3f} s that no change of one spring or two explains"
        for d in found.damages
    ]
    return "; ".join(places)


def changes(damage: Damage) -> str:
    """What changed, in words."""
    return " and ".join(f"{c.spring} {c.words}" for c in damage.ranking.changed)


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


def _damage(damage: Damage, found: Examination) -> str:
    at = damage.instant
    words = (
        f"Happened at {at.time:.3f} s (95 % interval {at.low:.3f} to {at.high:.3f} s), noticed"
        f" at {damage.alarm:.3f} s, identified from the data up to {damage.until:.3f} s."
        f" {_class(damage.ranking)}{_doubt(damage)}{_blind(damage, found)}"
    )
    return (
        f"<p>{escape(words)}</p>{figure(ranking_svg(damage.ranking))}{_places(damage)}"
        f"{_figures('Coefficients, with 95 % intervals.', damage.figures, damage.before)}"
    )


def _class(ranking: Ranking) -> str:
    changed = ranking.changed
    known = "No change of a single spring explains the data. " if ranking.second else ""
    vague = [
        f"This record cannot tell {c.name} from a change of {', '.join(c.alike)}."
        for c in changed
        if c.alike
    ]
    return known + (" ".join(vague) or "Nothing else looks like it in this record.")


def _doubt(damage: Damage) -> str:
    if damage.explained:
        return ""
    return (
        " Neither one change nor two at once explain the data; the figures below are not to be"
        " trusted."
    )


def _blind(damage: Damage, found: Examination) -> str:
    weak = damage.ranking.unseen
    total = len(found.reference.model.structure.springs)
    if not weak:
        return f" The data would show a tenth of stiffness lost at any of the {total} springs."
    return f" They would not show a tenth of stiffness lost at {', '.join(weak)}."


def _places(damage: Damage) -> str:
    head = ["coefficient", "means", "before", "after", "±", "score", "p", "χ²/f left"]
    rows = [
        [escape(c.name), escape(c.words), f"{c.before:.5g}", f"{c.after:.5g}",
         _number(c.deviation), f"{c.score:.4g}", _chance(c.p_value), _number(c.chi2)]
        for c in damage.ranking.candidates[:SHOWN]
    ]  # fmt: skip
    count = len(damage.ranking.candidates)
    words = f"Places, best of {count} first; p by chance as the best of all."
    return f'<p class="note">{words}</p>{table(head, rows, range(2, len(head)))}'


def _figures(words: str, after: Mapping[str, Figure], before: Mapping[str, Figure] | None) -> str:
    rows = [
        [escape(name), *([_with_interval(before[name])] if before else []), _with_interval(now)]
        for name, now in after.items()
    ]
    head = ["coefficient", *(["before", "after"] if before else ["value"])]
    return f'<p class="note">{escape(words)}</p>{table(head, rows, range(1, len(head)))}'


def _with_interval(found: Figure) -> str:
    if isnan(found.low):
        return f"{found.value:.6g} (known)"
    return f"{found.value:.6g} [{found.low:.6g}, {found.high:.6g}]"


def _chance(value: float) -> str:
    return f"{value:.2g}" if value > 1e-300 else "&lt; 1e-300"


def _number(value: float) -> str:
    return "" if isnan(value) else f"{value:.3g}"
