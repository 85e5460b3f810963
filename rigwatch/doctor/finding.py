"""The result of one check."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "warn", "fail"]


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check.

    Attributes:
        what: what was looked at.
        level: fail where rigwatch cannot run, warn where a part of it cannot.
        text: what was found.
        remedy: what to do, empty where all is well.
    """

    what: str
    level: Level
    text: str
    remedy: str = ""


def judged(what: str, good: bool, text: str, remedy: str, otherwise: Level = "fail") -> Finding:
    """A finding that is ok where `good` holds and carries the remedy where it does not."""
    return Finding(what, "ok", text) if good else Finding(what, otherwise, text, remedy)
