"""Replays a ledger: refits every recorded model and compares its error with the recorded one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from msgspec.structs import replace

from rigwatch.workbench.compare import comparison, open_bench
from rigwatch.workbench.study import Accepted, Study, lines, varied

SAME = 1e-6
"""Relative difference of errors allowed between machines."""


@dataclass(frozen=True)
class Check:
    """One step, repeated."""

    step: str
    effects: list[str]
    recorded: float
    found: float
    same: bool
    text: str


def replay(study: Study, progress: Callable[[str], None] = lambda _: None) -> list[Check]:
    """Refit the models of all steps that changed the effects; the study's file is not changed.

    Steps before the last change of the model's file are left out, as that model is gone.
    """
    checks: list[Check] = []
    accepted: dict[str, Accepted] = {}
    # The variants in force at the first step: those that the first change of base replaced.
    first = next((line for line in lines(study) if line["step"] == "base"), None)
    study = varied(study, first["before"] if first else study.file.variants)
    for line in lines(study):
        if line["step"] == "model-file":
            checks.clear()
        if line["step"] == "base":
            study = varied(study, line["variants"])
        if line["step"] == "add":
            accepted[f"{line['effect']}@{line['port']}"] = Accepted(
                effect=line["effect"],
                port=line["port"],
                parameters=line["parameters"],
                model=line.get("model_parameters", {}),
                ahead=line.get("ahead", False),
                beyond=line.get("beyond", ""),
            )
        if line["step"] not in ("add", "undo"):
            continue
        progress(f"{line['step']} {line['effect']}@{line['port']}")
        checks.append(_check(study, line, [accepted[label] for label in line["effects"]]))
    return checks


def _check(study: Study, line: dict[str, Any], effects: list[Accepted]) -> Check:
    then = Study(
        study.folder,
        replace(study.file, effects=tuple(effects)),
        study.model,
        study.effects,
        study.own,
        holds=study.holds,
    )
    found = comparison(open_bench(then)).held_out_error
    recorded = float(line["held_out_error"])
    same = abs(found / recorded - 1) < SAME
    label = f"{line['step']} {line['effect']}@{line['port']}"
    text = f"{label}: held-out error {recorded:.6g} in the ledger, {found:.6g} now"
    return Check(line["step"], line["effects"], recorded, found, same, text)
