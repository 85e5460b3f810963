"""What the ordering of samples gives out besides the samples themselves, and its counts."""

from dataclasses import dataclass
from typing import TypeAlias

from rigwatch.wire.messages import Severity
from rigwatch.wire.ordering.ring_protocol import Ask, S


@dataclass(frozen=True, slots=True)
class Loss:
    """Samples `first` to `last` of a boot are lost; if `last` < `first`, the number is unknown."""

    boot: int
    first: int
    last: int
    reason: str


@dataclass(frozen=True, slots=True)
class Remark:
    """An entry for the log."""

    severity: Severity
    code: str
    text: str


FORGED = "FORGED SAMPLES"
"""Code of the remark that samples arrived which the source never sent."""
POSITION_WRONG = "POSITION SET ASIDE"
"""Code of the remark that the resume position was beyond the newest sample of the source."""
Outcome: TypeAlias = S | Loss | Ask | Remark


@dataclass(slots=True)
class Counters:
    """Counts of samples so far.

    Attributes:
        delivered: samples delivered, including recovered ones.
        recovered: samples recovered from the ring.
        lost: samples known to be lost.
        duplicates: samples dropped because they were already delivered or given up.
        foreign: samples dropped because their source has no control.
    """

    delivered: int = 0
    recovered: int = 0
    lost: int = 0
    duplicates: int = 0
    foreign: int = 0
