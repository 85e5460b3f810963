"""Library names of the effects hidden in each machine, and the classification of an answer.

right       the effect named is hidden and not found yet, or indistinguishable from one that is
undecided   rivals are named, including a hidden effect
unknown     no known effect explains the error: nothing is named
astray      rivals are named, none of which is hidden
wrong       with confidence: an absent effect, or nothing missing while an effect is hidden
ended       nothing is missing, and all hidden effects are found
more        an effect is missing, although all hidden effects are found
"""

from collections.abc import Sequence
from dataclasses import dataclass

RIGHT: dict[str, dict[str, tuple[str, ...]]] = {
    "oscillator": {
        "coulomb": ("coulomb@load",),
        "cubic_stiffness": ("cubic_stiffness@load",),
        "quadratic_drag": ("quadratic_drag@load",),
        "dead_band": ("dead_band@drive",),
        "acceleration_lag": ("lag@acceleration_sensor", "delay@acceleration_sensor"),
    },
    "motor": {
        "coulomb": ("coulomb@shaft",),
        "fan": ("quadratic_drag@shaft",),
        "saturation": ("saturation@drive",),
        "drag_by_direction": ("viscous_by_direction@shaft",),
    },
    "pendulum": {
        "coulomb": ("coulomb@shaft",),
        "air_drag": ("quadratic_drag@shaft",),
        "late_drive": ("delay@drive", "lag@drive"),
        "imbalance": ("constant_force@shaft", "offset@drive"),
    },
    "damper": {
        "slider": ("jenkins@rod",),
        "hardening": ("cubic_stiffness@rod",),
        "joint": ("bouc_wen@rod",),
        "orifice": ("quadratic_drag@rod",),
        "preload": ("constant_force@rod", "offset@force_sensor"),
    },
    "tanks": {
        "leak": ("orifice@upper", "gain@level1_sensor", "gain@level2_sensor"),
        "dead_band": ("dead_band@pump",),
        "saturation": ("saturation@pump",),
        "late_pump": ("lag@pump", "delay@pump"),
        "inlet": ("constant_force@lower",),
    },
    "cascade": {
        "dead_band": ("dead_band@pump",),
        "saturation": ("saturation@pump",),
        "inlet": ("constant_force@lower",),
        "late_pump": ("lag@pump", "delay@pump"),
        "slow_level": ("lag@level_sensor", "delay@level_sensor", "lag@pump", "delay@pump"),
        "spill": (),
    },
}
"""Library names of each hidden effect; several if no recording can distinguish them, none if no
single effect describes it.

In two tanks of known base area with holes of unknown size, a leak of the upper tank reduces the
flow into the lower one by a fixed share. A wrong gain of either level sensor has the same effect:
flows are proportional to the square root of the level, so the gain scales holes and pump, except
for that share.
"""


@dataclass(frozen=True)
class Answer:
    """The verdict on a recording.

    Attributes:
        word: the verdict.
        members: labels of the effect named and of those indistinguishable from it.
        rivals: labels of effects of other physics that may be present instead.
        second: labels of the second missing effect.
    """

    word: str
    members: Sequence[str] = ()
    rivals: Sequence[str] = ()
    second: Sequence[str] = ()


def judged(machine: str, left: Sequence[str], answer: Answer) -> tuple[str, str]:
    """The class of an answer while `left` is still hidden, and which of these it finds."""
    if not left:
        return ("ended" if answer.word == "nothing_missing" else "more"), ""
    right = {name: set(RIGHT[machine][name]) for name in left}
    labels = {
        "missing_effect": set(answer.members),
        "undetermined": {*answer.members, *answer.rivals},
    }.get(answer.word, set())
    found = next((name for name in left if labels & right[name]), "")
    others = [name for name in left if name != found]
    second = any(set(answer.second) & right[name] for name in others)
    true = bool(found) and (second or not answer.second)
    match answer.word:
        case "missing_effect":
            return ("right" if true else "wrong"), found
        case "undetermined":
            return ("undecided" if true else "astray"), found
        case "nothing_missing":
            return "wrong", ""
        case _:
            return "unknown", ""
