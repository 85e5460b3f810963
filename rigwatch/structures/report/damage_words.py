"""The result of an examination as text."""

from collections.abc import Sequence

from rigwatch.structures.damage import LEAST, Damage, Examination, Ranking
from rigwatch.structures.model import label


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
    """The change, as text."""
    return " and ".join(f"{c.spring} {c.words}" for c in damage.ranking.changed)


def remark(found: Examination) -> str:
    """Caveats about the sensors, empty if every position is measured and judged."""
    model, unjudged = found.reference.model, found.reference.unjudged
    nodes = [label("x", node) for node in model.structure.nodes]
    hidden = [name for name in nodes if name not in (*model.signals, *unjudged)]
    words = f" {too_little(unjudged)}" if unjudged else ""
    if not hidden:
        return words
    return words + (
        f" The positions {', '.join(hidden)} were not measured: large changes that move them are"
        " noticed, but located less surely."
    )


def too_little(unjudged: Sequence[str]) -> str:
    """What it means that the undamaged start does not show the noise of some sensors."""
    return (
        f"{', '.join(unjudged)}: no undamaged noise to judge by (fewer than {LEAST} samples, or all"
        " 0), so nothing that was measured there counts."
    )


def rule(found: Examination) -> str:
    """The definition of an alarm."""
    if found.settings.limit is not None:
        return f"An alarm is a residual beyond {found.settings.limit:g}, the limit that was set."
    share = 100 * found.settings.rate
    return (
        "An alarm is a cumulative sum of squared residuals beyond a threshold that noise alone"
        f" reaches in {share:g} % of such records."
    )


def alike(ranking: Ranking) -> str:
    """The places that this record cannot distinguish."""
    changed = ranking.changed
    known = "No change of a single spring explains the data. " if ranking.second else ""
    vague = [
        f"This record cannot distinguish {c.name} from a change of {', '.join(c.alike)}."
        for c in changed
        if c.alike
    ]
    return known + (" ".join(vague) or "Nothing else looks like it in this record.")


def doubt(damage: Damage) -> str:
    """A warning if nothing explains the damage, else empty."""
    if damage.explained:
        return ""
    return (
        " Neither one change nor two at once explain the data; the figures below are not to be"
        " trusted."
    )


def unseen(damage: Damage, found: Examination) -> str:
    """The springs at which the data would not show damage."""
    weak = damage.ranking.unseen
    total = len(found.reference.model.structure.springs)
    if not weak:
        return f" The data would show a tenth of stiffness lost at any of the {total} springs."
    return f" They would not show a tenth of stiffness lost at {', '.join(weak)}."
