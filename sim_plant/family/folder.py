"""Writes members as folders of CSV files with `truth.json`, in the layout of a foreign rig."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sim_plant.family import scenarios
from sim_plant.family.flavours import FLAVOURS
from sim_plant.family.member import Member, draw
from sim_plant.family.recording import play
from sim_plant.family.scenarios import Scenario

PARTS: dict[str, Callable[[Member], dict[str, Scenario]]] = {
    "watch": scenarios.watch,
    "explain": scenarios.explain,
}
HEADER = "time_s,voltage_V,position_m,acceleration_m_s2"


def members(group: str, seed: int = 1) -> dict[str, Member]:
    """The members of `group` (calibration or judged) by name: one of each of its flavours."""
    kinds = [flavour for flavour, kind in FLAVOURS.items() if kind.group == group]
    if not kinds:
        raise ValueError(f"group {group!r}: expected calibration or judged")
    return {(m := draw(flavour, seed)).name: m for flavour in kinds}


def write_rig(folder: Path, member: Member, parts: tuple[str, ...] = ("watch", "explain")) -> None:
    """Writes the recordings of `parts` and truth.json to `folder`.

    The truth includes strengths and the moving mass `mass` [kg].
    """
    truth: dict[str, Any] = {"mass": member["mass"]}
    for part in parts:
        (folder / part).mkdir(parents=True, exist_ok=True)
        truth[part] = {}
        for name, scenario in PARTS[part](member).items():
            samples = play(member, name, scenario)
            np.savetxt(
                folder / part / f"{name}.csv", samples, "%.7g", ",", header=HEADER, comments=""
            )
            truth[part][name] = _truth(scenario)
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")


def _truth(scenario: Scenario) -> dict[str, Any]:
    said: dict[str, Any] = {"what": scenario.what}
    if scenario.from_s is not None and scenario.what in {"dry friction", "other fault"}:
        said["from_s"] = scenario.from_s
    if scenario.hidden:
        said["hidden"] = scenario.hidden
    if scenario.sensor:
        said["sensor"] = dict([scenario.sensor])
    return said
