"""The result of one check."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "warn", "fail"]


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check.

    Attributes:
        what: what was checked.
        level: fail if rigwatch cannot run, warn if a part of it cannot.
        text: what was found.
        remedy: what to do, empty if nothing is needed.
    """

    what: str
    level: Level
    text: str
    remedy: str = ""


def judged(what: str, good: bool, text: str, remedy: str, otherwise: Level = "fail") -> Finding:
    """A finding that is ok if `good` holds and carries the remedy if not."""
    return Finding(what, "ok", text) if good else Finding(what, otherwise, text, remedy)
