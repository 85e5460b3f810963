"""One effect at one port as the ranking lists it, and the order of the rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.equations import EffectParameter, Placement
from rigwatch.physics.engine.score import Candidate, Standing
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.study import Accepted

SAME = 0.9995
"""Cosine above which two effects are one, whatever they are called."""
SIMILAR = 0.8
"""Cosine below which two effects explain different parts of the error."""


@dataclass(eq=False)
class Ranked:
    """One effect at one port.

    Attributes:
        placement: which one, and where.
        kind: of the port: force, actuator or sensor.
        p_value: of the score, corrected for the number of candidates.
        explained: share of the residual's energy in training that it explains to first order.
        start: values that its fit starts from.
        alike: effects whose effect on this recording is nearly parallel, as "effect@port".
        cosines: with every other effect, by its label.
        turned: the same with a sign: negative where both explain the residual in opposite ways.
        fitted: with it in the model; None where it was not worth a fit or the fit failed.
        gain: fall of the held-out mean squared error, None without a fit.
        accepted: whether the held-out error falls by more than chance.
        reason: in words.
        trouble: why it cannot be fitted, empty where it can.
        told_by: what is fitted in its place, as it looks the same; empty where nothing is.
    """

    placement: Placement
    kind: str
    p_value: float
    explained: float
    start: dict[str, float]
    alike: list[str]
    cosines: dict[str, float]
    turned: dict[str, float]
    fitted: Fitted | None = None
    gain: float | None = None
    accepted: bool = False
    reason: str = "not like the residual"
    trouble: str = ""
    told_by: str = ""

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.placement.name

    @property
    def port(self) -> str:
        """Where it may be missing."""
        return self.placement.port

    @property
    def free(self) -> int:
        """Parameters that a fit of it moves."""
        return self.placement.effect.free

    @property
    def label(self) -> str:
        """Effect and port in one word."""
        return f"{self.effect}@{self.port}"

    def begin(self, share: float = 1.0) -> dict[str, float]:
        """Values that its fit starts from, by the system's names: a share of its strength alone."""
        effect, values = self.placement.effect, dict(self.start)
        p = effect.parameters[effect.strength]
        values[effect.strength] = _within(p, share * (values[effect.strength] - p.neutral))
        return {self.placement.prefix + name: value for name, value in values.items()}

    @property
    def held_out_error(self) -> float:
        """Held-out error with it, infinite without a fit."""
        return self.fitted.held_out_error if self.fitted else float("inf")


def row_of(candidate: Candidate, found: Standing, kind: str) -> Ranked:
    """The row of an effect that is scored and not yet fitted; `kind` is its port's."""
    return Ranked(
        Placement(candidate.name, candidate.effect, candidate.port),
        kind,
        found.p_value,
        found.explained,
        start_of(candidate, found.strength),
        found.alike,
        found.cosines,
        found.turned,
    )


def start_of(candidate: Candidate, strength: float) -> dict[str, float]:
    """Values that a fit of an effect of this strength begins with, by the effect's own names."""
    effect = candidate.effect
    begin = _within(effect.parameters[effect.strength], strength)
    return {**candidate.shape, effect.strength: begin}


def _within(p: EffectParameter, strength: float) -> float:
    """Where the fit of an effect of this strength begins."""
    return 1.0 if p.role == "switch" else float(np.clip(p.neutral + strength, p.low, p.high))


def accepted_from(row: Ranked) -> Accepted:
    """The row as a study's file lists it, its fit's values to start from."""
    assert row.fitted is not None
    prefix = row.placement.prefix
    values = {
        name[len(prefix) :]: value
        for name, value in row.fitted.train.values().items()
        if name.startswith(prefix)
    }
    return Accepted(effect=row.effect, port=row.port, parameters=values)


def in_order(rows: Sequence[Ranked]) -> list[Ranked]:
    """What is accepted first, then what was fitted, each by its error, then all others."""
    return sorted(rows, key=_order)


def _order(row: Ranked) -> tuple[int, float, float]:
    return (
        0 if row.accepted else 1 if row.fitted else 2,
        row.held_out_error if row.fitted else 0.0,
        -row.explained,
    )
