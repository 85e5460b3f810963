"""The residual over position and velocity as a map with selectable cells."""

import re
from dataclasses import dataclass
from typing import Any

from rigwatch.browser.views.study_state import State

SIZE = 260
LEFT = 54
_NAME = re.compile(r"x (\S+) to (\S+), v (\S+) to (\S+)")


@dataclass(frozen=True)
class Cell:
    """One cell.

    Attributes:
        number: of its region.
        x, y, width, height: of the cell [pixels].
        colour: "plus" or "minus", by the sign of the mean residual.
        strength: of the colour, 0 to 1.
        told: description in words.
    """

    number: int
    x: float
    y: float
    width: float
    height: float
    colour: str
    strength: float
    told: str


@dataclass(frozen=True)
class Map:
    """The map of one channel, with labels at the ends of its axes."""

    cells: list[Cell]
    x: tuple[float, float]
    v: tuple[float, float]
    units: tuple[str, str]


def motion_map(state: State) -> dict[str, Map]:
    """One map per channel; none if the model has no motion."""
    found: dict[str, list[tuple[int, dict[str, Any], list[float]]]] = {}
    for number, region in enumerate(state.results.read("regions") or []):
        match = _NAME.fullmatch(region["name"]) if region["view"] == "motion" else None
        if match:
            place = [float(text) for text in match.groups()]
            found.setdefault(region["channel"], []).append((number, region, place))
    return {channel: _map(state, channel, cells) for channel, cells in found.items()}


def _map(state: State, channel: str, found: list[tuple[int, dict[str, Any], list[float]]]) -> Map:
    x = min(p[0] for _, _, p in found), max(p[1] for _, _, p in found)
    v = min(p[2] for _, _, p in found), max(p[3] for _, _, p in found)
    most = max(abs(region["mean"]) for _, region, _ in found) or 1.0
    unit = state.study.model.outputs[channel].unit
    cells = []
    for number, region, (x0, x1, v0, v1) in found:
        across, up = SIZE / max(x[1] - x[0], 1e-300), SIZE / max(v[1] - v[0], 1e-300)
        told = (
            f"{region['name']}: mean {region['mean']:.3g} {unit}, rms {region['rms']:.3g} {unit},"
            f" {region['share']:.0%} of the energy, {region['count']} samples"
        )
        cells.append(
            Cell(
                number, LEFT + (x0 - x[0]) * across, (v[1] - v1) * up, (x1 - x0) * across,
                (v1 - v0) * up, "plus" if region["mean"] > 0 else "minus",
                0.08 + 0.92 * abs(region["mean"]) / most, told,
            )
        )  # fmt: skip
    return Map(sorted(cells, key=lambda c: (c.y, c.x)), x, v, _units(state))


def _units(state: State) -> tuple[str, str]:
    model = state.study.model
    for x, v in (("position", "velocity"), ("x", "v")):
        for table in (model.inputs, model.states):
            if x in table and v in table:
                return table[x].unit, table[v].unit
    return "", ""
