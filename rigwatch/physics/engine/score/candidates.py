"""Candidates: every effect at every compatible port, in each shape tried.

The score test estimates the strength of a candidate; its other parameters, the shape, have fixed
values, scaled to the signals at the port.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rigwatch.physics.engine.equations import Effect
from rigwatch.wire.arrays import FloatArray

EffectAt = Callable[[str, str], Effect | None]
"""Maps names of effect and port to the effect scaled for that port, None if not compatible."""


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing at a port, with values for its shape parameters."""

    name: str
    effect: Effect
    port: str
    shape: dict[str, float] = field(default_factory=dict, hash=False)

    @property
    def label(self) -> str:
        """Effect and port as "effect@port", equal for all shapes."""
        return f"{self.name}@{self.port}"


def candidates(
    ports: Iterable[str],
    effects: Mapping[str, Effect],
    effect_at: EffectAt,
    *,
    elective: bool = False,
) -> list[Candidate]:
    """Every effect at every compatible port, in each of its shapes.

    Args:
        ports, effects: by name.
        effect_at: returns the scaled effect at a port, or None.
        elective: include elective effects; verdicts are calibrated without them, and more
            candidates make larger classes.
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
    """The candidates of one effect at one port, one per combination of shape values."""
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
    """Root mean squares of the variables at a port, for `Effect.scaled`.

    Args:
        variables: the port's own, by name, each of shape (samples,).
        signal: of an actuator or sensor, shape (samples,); None at a force.
        dt: time between samples [s].

    Returns:
        Size of each variable, with `dt` [s] and, at a signal port, `u` and its derivative `rate`.
    """
    sizes = {"dt": dt} | {name: root_mean_square(values) for name, values in variables.items()}
    if signal is not None:
        sizes["u"] = root_mean_square(signal)
        sizes["rate"] = root_mean_square(np.gradient(signal, dt))
    return sizes


def root_mean_square(signal: FloatArray) -> float:
    """Root mean square without NaN; 1 for a signal without size, so that it can divide."""
    known = signal[np.isfinite(signal)]
    size = float(np.sqrt(np.mean(np.square(known)))) if len(known) else 0.0
    return size if size > 0 else 1.0
