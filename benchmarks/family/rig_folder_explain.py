"""The workbench on a folder of recordings with one hidden effect each: verdict, name, strength."""

import shutil
from dataclasses import dataclass, field
from typing import Any

from benchmarks.family.rig_folder import WEIGHING, RigFolder, Tally, answer, command

DRY = ("coulomb", "lugre", "stribeck", "dahl", "bliman", "jenkins", "bouc")
ACCEPTED: dict[str, tuple[str, ...]] = {
    "coulomb": DRY,
    "coulomb_strong": DRY,
    "spring": ("linear_stiffness",),
    "cubic": ("cubic",),
    "drag": ("drag",),
    "deadband": ("dead",),
    "saturation": ("saturation",),
    "binding": ("position", "binding"),
    "accel_gain": ("gain",),
    "accel_late": ("lag@acc", "delay@acc", "filter@acc", "average@acc", "smooth", "digital"),
}
"""Parts of names that are right for a hidden effect."""
STRENGTHS = {"dry": "Fc", "deadband": "b", "saturation": "us", "cubic": "k3", "spring": "k"}
"""The library's symbol for the strength of a hidden effect."""
CLOSE = 0.15
MASS = """\
[start]
m = {mass:.6g}
[deviation]
m = {deviation:.2g}
"""
STUDY = """\
model = "{model}"
[[train]]
session = "{name}.mcap"
start = 8.0
end = 24.0
[[held_out]]
session = "{name}.mcap"
start = 24.0
[[healthy]]
session = "healthy.mcap"
start = 8.0
"""


@dataclass
class Explained:
    """The workbench's results for a folder.

    Attributes:
        tally: right; strength close and strength in its interval, of effects named.
        wrong: verdicts "missing_effect" that name the wrong one.
        lines: one for each recording.
    """

    tally: Tally = field(default_factory=Tally)
    wrong: int = 0
    lines: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """One line."""
        return f"{self.tally}, wrong with confidence {self.wrong}"


def explained(rig: RigFolder, model: str, *, weighed: bool = False) -> Explained:
    """Explains every recording of `explain` with the base `model` and counts.

    Args:
        rig: the recordings.
        model: name of the base model.
        weighed: tell the study the moving mass.
    """
    found = Explained()
    for name, told in rig.truth("explain").items():
        if told["what"] != "healthy":
            _judge(found, name, told, *explanation(rig, name, model, weighed=weighed))
    return found


def explanation(
    rig: RigFolder, name: str, model: str, *, weighed: bool = False
) -> tuple[dict[str, Any], str]:
    """The result of `rigwatch explain` for a recording, or its failure in words."""
    rig.session("explain", "healthy")
    rig.session("explain", name)
    folder = rig.work / "explain"
    study, template = folder / f"study_{name}_{model}", folder / f"{name}_{model}.toml"
    shutil.rmtree(study, ignore_errors=True)
    text = STUDY.format(model=model, name=name)
    if weighed and (mass := rig.weighed()):
        text += MASS.format(mass=mass, deviation=WEIGHING * mass)
    template.write_text(text, encoding="utf-8")
    made = command("study", "new", study, "--template", template, "--sessions", folder)
    if made.returncode:
        return {}, made.stderr.strip()[-200:]
    return answer("explain", study)


def named(said: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """The first of the ranking, and the names of its class and of a second effect."""
    top = said["ranking"][0] if said["ranking"] else {"effect": "", "port": "", "class": []}
    return top, " ".join([f"{top['effect']}@{top['port']}", *top["class"], *said["also"]])


def is_right(what: str, verdict: str, names: str) -> bool:
    """Whether a verdict fits the hidden effect; `names` are of the first, its class and more."""
    match what:
        case "none":
            return verdict == "nothing_missing"
        case "pressure":
            return verdict != "missing_effect"
        case "two":
            both = any(dry in names for dry in DRY) and "cubic" in names
            return both and verdict in {"missing_effect", "undetermined"}
        case _:
            return verdict == "missing_effect" and any(part in names for part in ACCEPTED[what])


def _judge(
    found: Explained, name: str, told: dict[str, Any], said: dict[str, Any], failed: str
) -> None:
    what = told["what"]
    if not said:
        found.tally.count("right", right=False)
        found.lines.append(f"BAD {name:26s} {failed}")
        return
    top, names = named(said)
    right = is_right(what, said["verdict"], names)
    found.tally.count("right", right)
    found.wrong += said["verdict"] == "missing_effect" and not right
    strength = _strength(found, told, top) if right and what in ACCEPTED else ""
    error = said["comparison"]["held_out_error"]
    floor = said["comparison"]["noise_floor"]
    found.lines.append(
        f"{'ok ' if right else 'BAD'} {name:26s} {said['verdict']:16s} {names[:60]:60s} "
        f"held out {error:.3g}, floor {floor:.3g} {strength}"
    )


def _strength(found: Explained, told: dict[str, Any], top: dict[str, Any]) -> str:
    """Counts whether the strength is close to the truth and in its interval, and reports it."""
    strength = strength_of(told, top)
    if strength is None:
        return ""
    key, true, value, low, high = strength
    found.tally.count("strength close", abs(value / true - 1.0) <= CLOSE)
    found.tally.count("strength in interval", low <= true <= high)
    return f"{key} {value:.3g} ({low:.3g} to {high:.3g}), truth {true:.3g}"


def strength_of(
    told: dict[str, Any], top: dict[str, Any]
) -> tuple[str, float, float, float, float] | None:
    """The hidden effect, its strength, the strength found, and its interval."""
    for key, true in told.get("hidden", {}).items():
        for symbol, figure in top.get("parameters", {}).items():
            if symbol.rpartition(".")[2] == STRENGTHS.get(key):
                return key, true, figure["value"], *figure["interval"]
    return None
