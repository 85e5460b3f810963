"""What a library of effects calls what is hidden in a machine, and how good an answer is.

right       what is named is hidden and not found yet, or cannot be told from what is
undecided   rivals are named, the truth among them
unknown     no known effect explains the error: nothing is named
astray      rivals are named, the truth not among them
wrong       with confidence: an effect that is not there, or nothing missing where more is
ended       nothing is missing, once all is found
more        something still is, though all is found
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
}
"""What the library calls each hidden effect; several where they are one on any recording.

Of two tanks on known grounds with holes of unknown size, a leak of the upper one takes a share of
what reaches the lower one. That is what a wrong gain of either level makes of it: flows go with the
root of a level, so that its gain is a factor of holes and pump but for that share.
"""


@dataclass(frozen=True)
class Answer:
    """What was said of a recording.

    Attributes:
        word: the verdict.
        members: labels of what is named and what it cannot be told from.
        rivals: labels of what may be there in its place.
        second: labels of what is said to be missing as well.
    """

    word: str
    members: Sequence[str] = ()
    rivals: Sequence[str] = ()
    second: Sequence[str] = ()


def judged(machine: str, left: Sequence[str], answer: Answer) -> tuple[str, str]:
    """How good an answer is where `left` is still hidden, and which of it is found."""
    if not left:
        return ("ended" if answer.word == "nothing_missing" else "more"), ""
    right = {name: set(RIGHT[machine][name]) for name in left}
    labels = {
        "missing_effect": set(answer.members),
        "undetermined": {*answer.members, *answer.rivals},
    }.get(answer.word, set())
    found = next((name for name in left if labels & right[name]), "")
    others = [name for name in left if name != found]
    beside = any(set(answer.second) & right[name] for name in others)
    true = bool(found) and (beside or not answer.second)
    match answer.word:
        case "missing_effect":
            return ("right" if true else "wrong"), found
        case "undetermined":
            return ("undecided" if true else "astray"), found
        case "nothing_missing":
            return "wrong", ""
        case _:
            return "unknown", ""
