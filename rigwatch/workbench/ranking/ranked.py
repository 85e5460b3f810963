"""One row of the ranking, an effect at a port, and the order of rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.equations import EffectParameter, Placement
from rigwatch.physics.engine.score import Candidate, Standing
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking.paired_test import difference
from rigwatch.workbench.study import Accepted

SAME = 0.9995
"""Cosine above which two effects count as identical."""
SIMILAR = 0.8
"""Cosine below which two effects explain different parts of the error."""


UNFITTABLE = "cannot be fitted"
"""Reason of a row whose fit was tried and failed."""


@dataclass(eq=False)
class Ranked:
    """One effect at one port.

    Attributes:
        placement: the effect and its port.
        kind: of the port: force, actuator or sensor.
        p_value: of the score, corrected for the number of candidates.
        p_alone: the same without this correction.
        likely: whether the score speaks for a fit, see `select_for_fit`.
        explained: share of the training residual's energy that it explains to first order.
        start: initial values of its fit, by the effect's own parameter names.
        alike: effects whose directions on this recording are nearly parallel, as "effect@port".
        cosines: absolute cosine with every other effect, by label.
        signed_cosines: the same with its sign: negative if the two explain opposite parts of the
            residual.
        fitted: the model fitted with it; None if not fitted or if the fit failed.
        gain: fall of the held-out mean squared error, None without a fit.
        accepted: whether the held-out error falls by more than chance.
        reason: why it is accepted, refused or not fitted, in words.
        failure: why its fit failed, or why it cannot be what is missing; empty otherwise.
        fitted_instead: label of the similar effect fitted in its place; empty if there is none.
        vague: whether it is refused as the training does not determine its strength.
        begun_again: whether its fit has also been begun from the model's given values.
    """

    placement: Placement
    kind: str
    p_value: float
    explained: float
    start: dict[str, float]
    alike: list[str]
    cosines: dict[str, float]
    signed_cosines: dict[str, float]
    fitted: Fitted | None = None
    gain: float | None = None
    accepted: bool = False
    reason: str = "not like the residual"
    failure: str = ""
    fitted_instead: str = ""
    vague: bool = False
    begun_again: bool = False
    p_alone: float = 1.0
    likely: bool = False

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.placement.name

    @property
    def port(self) -> str:
        """Name of the port."""
        return self.placement.port

    @property
    def free(self) -> int:
        """Number of free parameters of the effect."""
        return self.placement.effect.free

    @property
    def label(self) -> str:
        """Effect and port as "effect@port"."""
        return f"{self.effect}@{self.port}"

    @property
    def unfittable(self) -> bool:
        """Whether its fit was tried and failed."""
        return self.fitted is None and self.reason == UNFITTABLE

    def take(self, other: "Ranked") -> None:
        """Store the fit of another row of the same effect, and its decision."""
        self.fitted, self.gain, self.accepted = other.fitted, other.gain, other.accepted
        self.reason, self.failure, self.vague = other.reason, other.failure, other.vague
        self.begun_again = other.begun_again

    def begin(self, share: float = 1.0) -> dict[str, float]:
        """Initial values of its fit, by the system's names, at a share of its strength."""
        effect, values = self.placement.effect, dict(self.start)
        p = effect.parameters[effect.strength]
        values[effect.strength] = _within(p, share * (values[effect.strength] - p.neutral))
        return {self.placement.prefix + name: value for name, value in values.items()}

    @property
    def held_out_error(self) -> float:
        """Held-out error with the effect in the model, infinite without a fit."""
        return self.fitted.held_out_error if self.fitted else float("inf")


def same_family(best: Ranked, row: Ranked) -> bool:
    """Whether both belong to one family of the library."""
    family = best.placement.effect.family
    return bool(family) and row.placement.effect.family == family


def row_of(candidate: Candidate, found: Standing, kind: str) -> Ranked:
    """The row of a scored, not yet fitted effect; `kind` is that of its port."""
    return Ranked(
        Placement(candidate.name, candidate.effect, candidate.port),
        kind,
        found.p_value,
        found.explained,
        start_of(candidate, found.strength),
        found.alike,
        found.cosines,
        found.signed_cosines,
    )


def start_of(candidate: Candidate, strength: float) -> dict[str, float]:
    """Initial values for fitting an effect of this strength, by the effect's own names."""
    effect = candidate.effect
    begin = _within(effect.parameters[effect.strength], strength)
    return {**candidate.shape, effect.strength: begin}


def _within(p: EffectParameter, strength: float) -> float:
    """Initial value of the strength parameter, within its bounds."""
    return 1.0 if p.role == "switch" else float(np.clip(p.neutral + strength, p.low, p.high))


def error_ratio(one: Ranked, other: Ranked) -> float:
    """Held-out error of another fitted row over that of one, on the samples that count for both.

    Samples from which the states of an effect are found do not count for it.
    """
    assert one.fitted is not None
    assert other.fitted is not None
    own, others = one.fitted.held_out, other.fitted.held_out
    one_counts, other_counts = (np.isfinite(fit.residuals).ravel() for fit in (own, others))
    if np.array_equal(one_counts, other_counts):
        return other.held_out_error / one.held_out_error
    return 1.0 - difference(own, others).relative


def lowest(rows: Sequence[Ranked]) -> Ranked:
    """The fitted row with the smallest held-out error, each two compared where both count."""
    found = min(rows, key=lambda row: row.held_out_error)
    for row in rows:
        if row is not found and error_ratio(found, row) < 1.0:
            found = row
    return found


def accepted_from(row: Ranked) -> Accepted:
    """The row as an entry of the study's file, with its fitted parameters."""
    assert row.fitted is not None
    values = row.placement.own(row.fitted.train.values())
    placed = row.fitted.placements[-1]
    return Accepted(
        effect=row.effect, port=row.port, parameters=values, ahead=placed.ahead,
        beyond=placed.beyond,
    )  # fmt: skip


def in_order(rows: Sequence[Ranked]) -> list[Ranked]:
    """Accepted rows first, then fitted rows, each by held-out error, then all others."""
    return sorted(rows, key=_order)


def best_accepted(rows: Sequence[Ranked]) -> Ranked | None:
    """The accepted row with the smallest held-out error; None without one."""
    return next(iter(in_order([row for row in rows if row.accepted])), None)


def _order(row: Ranked) -> tuple[int, float, float]:
    return (
        0 if row.accepted else 1 if row.fitted else 2,
        row.held_out_error if row.fitted else 0.0,
        -row.explained,
    )
