"""Which effects may be missing where: every effect at every port, in each shape that is tried.

The strength of a candidate is what the score test estimates; its other parameters, the shape, are
given values. Those are shares of the signals' sizes at the port.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rigwatch.physics.engine.equations import Effect
from rigwatch.wire.arrays import FloatArray

EffectAt = Callable[[str, str], Effect | None]
"""An effect and a port, by name: the effect with that port's sizes, None where it cannot stand."""


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing at a port, with values for its shape parameters."""

    name: str
    effect: Effect
    port: str
    shape: dict[str, float] = field(default_factory=dict, hash=False)

    @property
    def label(self) -> str:
        """Effect and port in one word, the same for all its shapes."""
        return f"{self.name}@{self.port}"


def candidates(
    ports: Iterable[str],
    effects: Mapping[str, Effect],
    effect_at: EffectAt,
    *,
    elective: bool = False,
) -> list[Candidate]:
    """Every effect at every port where it can stand, in each of its shapes.

    Args:
        ports, effects: by name.
        effect_at: which effect stands where.
        elective: whether elective effects are among them: verdicts are calibrated without these,
            and more candidates make larger classes.
    """
    names = [name for name, effect in effects.items() if elective or not effect.elective]
    placed = ((name, effect_at(name, port), port) for port in ports for name in names)
    return [
        candidate
        for name, effect, port in placed
        if effect is not None
        for candidate in shaped(name, effect, port)
    ]


def shaped(name: str, effect: Effect, port: str) -> list[Candidate]:
    """The candidates of one effect at one port: one a combination of the shapes that are tried."""
    grids = [
        [(key, value) for value in (p.tried or (p.value,))]
        for key, p in effect.parameters.items()
        if p.role not in ("strength", "switch")
    ]
    combinations: list[list[tuple[str, float]]] = [[]]
    for grid in grids:
        combinations = [[*c, choice] for c in combinations for choice in grid]
    return [Candidate(name, effect, port, dict(c)) for c in combinations]


def sizes_at_port(
    variables: Mapping[str, FloatArray], signal: FloatArray | None, dt: float
) -> dict[str, float]:
    """Root mean squares of what effects at a port see, for `Effect.scaled`.

    Args:
        variables: the port's own, by name, each of shape (samples,).
        signal: of an actuator or sensor, shape (samples,); None at a force.
        dt: time between samples [s].

    Returns:
        A size a variable, with `dt` [s] and, of a signal, `u` and `rate`, that of its derivative.
    """
    sizes = {"dt": dt} | {name: root_mean_square(values) for name, values in variables.items()}
    if signal is not None:
        sizes["u"] = root_mean_square(signal)
        sizes["rate"] = root_mean_square(np.gradient(signal, dt))
    return sizes


def root_mean_square(signal: FloatArray) -> float:
    """Of the samples that are no NaN; 1 of a signal that is always 0, so that it can divide."""
    size = float(np.sqrt(np.nanmean(np.square(signal))))
    return size if size > 0 else 1.0
