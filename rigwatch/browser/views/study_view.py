"""The parts of a study's page, each a fragment of HTML that replaces the previous one."""

from dataclasses import dataclass, field
from typing import Any

from rigwatch.browser.views.at_rig import AtRig, falls, in_force, rehearsal_of
from rigwatch.browser.views.equivalents import adding, every_step
from rigwatch.browser.views.motion_map import motion_map
from rigwatch.browser.views.pages import render
from rigwatch.browser.views.study_state import State
from rigwatch.workbench.data import predicts_along_motion
from rigwatch.workbench.explain import Explanation, Row
from rigwatch.workbench.report import VERDICTS, at_its_bounds, doubt_of

PARTS = ("verdict", "ledger", "missing", "where", "parameters", "data")
VIEWS = {
    "direction": "Direction of motion",
    "amplitude": "Distance from the mean position",
    "input": "Size of the drive",
    "time": "Time",
    "frequency": "Frequency",
    "lines": "Lines of the excitation",
}


@dataclass
class Candidate:
    """A row of the ranking with the rows that are indistinguishable from it.

    Attributes:
        row: from `explain`.
        told: evidence for it.
        physics: of the effect, in a sentence.
        alike: rows of its class that are not listed separately.
    """

    row: Row
    told: dict[str, Any]
    physics: str
    alike: "list[Candidate]" = field(default_factory=list)

    @property
    def label(self) -> str:
        """ "effect@port"."""
        return f"{self.row.effect}@{self.row.port}"

    @property
    def held_out(self) -> float | None:
        """Held-out error of its latest fit."""
        found = self.told.get("held_out_error", self.row.held_out_error)
        return None if found is None else float(found)

    @property
    def accepted(self) -> bool:
        """Whether the held-out error supports it."""
        return bool(self.told.get("accepted", self.row.accepted))

    @property
    def reason(self) -> str:
        """The reason for the decision, in words."""
        return str(self.told.get("reason", self.row.reason))


def parts_of(state: State, rig: AtRig | None = None) -> dict[str, str]:
    """All parts by name; `rig`: the rig to promote to."""
    rehearsal = rehearsal_of(state, rig)
    values = {
        "s": state,
        "headline": headline(state),
        "doubt": doubt(state),
        "candidates": candidates(state),
        "regions": regions(state),
        "views": VIEWS,
        "maps": motion_map(state),
        "commands": every_step(state.whole, rig.config if rig else None),
        "no_experiment": no_experiment(state),
        "rig": rig,
        "rehearsal": rehearsal,
        "falls": falls(rehearsal),
        "in_force": in_force(state, rig),
    }
    return {name: render(f"{name}.html", **values) for name in PARTS}


def headline(state: State) -> str:
    """The verdict in a sentence."""
    found = state.explanation
    if found is None:
        return "Compared, not explained yet" if state.comparison else "Not fitted yet"
    text = VERDICTS[found.verdict]
    if found.verdict in ("missing_effect", "undetermined"):
        text = _in_words(found) + at_its_bounds(found)
    return text[0].upper() + text[1:]


def _in_words(found: Explanation) -> str:
    """The verdict's sentence with plain names of effects."""
    text = found.text
    for row in found.ranking:
        text = text.replace(
            f"{row.effect}@{row.port}", f"{row.effect.replace('_', ' ')} at {row.port}"
        )
    return text


def doubt(state: State) -> str:
    """How often similar verdicts were wrong."""
    return doubt_of(state.explanation) if state.explanation else ""


def candidates(state: State) -> list[Candidate]:
    """The ranking, with indistinguishable effects below the best of them."""
    if state.explanation is None:
        return []
    shown: list[Candidate] = []
    for row in state.explanation.ranking:
        physics = (
            state.study.effects[row.effect].physics if row.effect in state.study.effects else ""
        )
        label = f"{row.effect}@{row.port}"
        one = Candidate(row, state.evidence.get(label, {}), physics)
        like = next((c for c in shown if label in c.row.class_ and not _fitted(one)), None)
        (like.alike if like else shown).append(one)
    return shown


def _fitted(one: Candidate) -> bool:
    return one.held_out is not None


def regions(state: State) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Regions of the residual by channel and view, each with its number."""
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for number, region in enumerate(state.results.read("regions") or []):
        views = found.setdefault(region["channel"], {})
        views.setdefault(region["view"], []).append(region | {"number": number})
    for views in found.values():
        for name in ("time", "frequency", "amplitude", "input"):
            views.get(name, []).sort(key=lambda region: _first_number(region["name"]))
    return found


def _first_number(name: str) -> float:
    words = [word for word in name.split() if word[0].isdigit() or word[0] == "-"]
    try:
        return float(words[0])
    except (IndexError, ValueError):
        return 0.0


def no_experiment(state: State) -> str:
    """Why no next experiment is proposed."""
    found = state.explanation
    if found is None or found.next_experiment is not None:
        return ""
    if not found.rivals:
        return "None is needed: no effect of other physics explains this recording as well."
    if predicts_along_motion(state.study):
        return (
            "None can be predicted: the model goes along the measured motion, which another"
            " excitation would change."
        )
    return "None of the excitations tried separates the rivals better than this recording."


def candidate_html(state: State, label: str) -> str:
    """One candidate with the evidence for it; empty if the name is unknown."""
    every = [one for c in candidates(state) for one in (c, *c.alike)]
    found = next((c for c in every if c.label == label), None)
    if found is None:
        return ""
    gains = found.told.get("blocks", [])
    most = max((abs(g) for g in gains), default=1.0) or 1.0
    return render(
        "detail.html", c=found, now=state.comparison, latest=state.latest,
        blocks=[g / most for g in gains], better=sum(g > 0 for g in gains),
        command=adding(state.whole, found.row.effect, found.row.port),
    )  # fmt: skip
