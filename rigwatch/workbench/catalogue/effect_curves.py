"""Curves of an effect along a unit sine and a unit step of its variables.

A force is plotted against the position and the speed of the sine, a signal against its input. Both
are plotted against time after a step; for a force the step is a short move.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import LEFT, TIME, Effect, EffectParameter, names_in
from rigwatch.physics.engine.fit import EffectStates
from rigwatch.wire.arrays import FloatArray

FINE, SAMPLED = 1 / 400, 1 / 40
"""Time between points for continuous effects and for sampled ones [s]."""
PERIODS, MOVE = 2, (0.2, 0.3)
"""Number of one-second periods (the last one is shown); start and end of the move [s]."""
SEEN = {"T": (1.0, 0.5), "pu": (2.0, 0.9), "pd": (1.0, 0.0), "Ta": (1.0, 0.0)}
"""Mean and amplitude of variables that are no motion; all others have amplitude 1 about zero."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve.

    Attributes:
        across, up: labels of the horizontal and the vertical axis.
        x, y: shape (points,).
    """

    across: str
    up: str
    x: FloatArray
    y: FloatArray


def effect_curves(effect: Effect) -> tuple[Curve, ...]:
    """The curves of an effect of the library."""
    spacing = SAMPLED if effect.sampled else FINE
    time = np.arange(0, PERIODS, spacing, dtype=np.float64)
    wave, speed = np.sin(2 * np.pi * time), np.cos(2 * np.pi * time) * 2 * np.pi
    last = time >= PERIODS - 1
    sine = _along(effect, time, wave, speed)
    until = np.clip((time - MOVE[0]) / (MOVE[1] - MOVE[0]), 0.0, 1.0)
    if effect.port == "force":
        moved = until**2 * (3 - 2 * until)
        rate = np.asarray(np.gradient(moved, spacing), np.float64)
        step = _along(effect, time, moved, rate)
        return (
            Curve(_first(effect), "force", wave[last], sine[last]),
            Curve("v", "force", speed[last], sine[last]),
            Curve("time after a move [s]", "force", time, step),
        )
    step = _along(effect, time, np.where(time >= MOVE[0], 1.0, 0.0), np.zeros_like(time))
    return (
        Curve("arrives", "leaves", wave[last], sine[last]),
        Curve("time after a step [s]", "leaves", time, step),
    )


def _first(effect: Effect) -> str:
    """The variable used as position: the first that the effect names."""
    seen = [n for n in ("x", "p", "pu", "i", "ic", "psi", "T") if n in _names(effect)]
    return seen[0] if seen else "x"


def _names(effect: Effect) -> frozenset[str]:
    texts = [effect.expression, *(s.derivative or s.update for s in effect.states.values())]
    return frozenset().union(*(names_in(text, "effect") for text in texts))


def _along(effect: Effect, time: FloatArray, wave: FloatArray, speed: FloatArray) -> FloatArray:
    """The effect's output along the signals, shape (n,)."""
    own = {*effect.parameters, *effect.states, TIME, LEFT}
    signals = {"v": speed, "x": wave, "u": wave}
    for name in _names(effect) - own - set(signals):
        middle, swing = SEEN.get(name, (0.0, 1.0))
        signals[name] = middle + swing * wave
    sizes = {name: float(np.sqrt(np.mean(wave**2))) or 1.0 for name in signals}
    sizes |= {"v": 2 * np.pi * sizes["x"], "dt": SAMPLED, "rate": 2 * np.pi * sizes["x"]}
    values = _values(effect.scaled(sizes))
    spacing = np.full(len(time), time[1] - time[0])
    along = {TIME: time, LEFT: np.zeros_like(time), **signals}
    if effect.states:
        along |= EffectStates(effect, {TIME: time, **signals}, spacing, "linear").run(values)
    return evaluated(effect.expression, along, values, "effect")


def _values(effect: Effect) -> dict[str, float]:
    """Parameter values for drawing; with a visible strength if the file's value is neutral."""
    found = {n: _within_the_sine(p) for n, p in effect.parameters.items()}
    p = effect.parameters[effect.strength]
    if p.role == "switch":
        return found | {effect.strength: 1.0}
    shown = p.neutral + 0.5 if p.value == p.neutral else p.value
    return found | {effect.strength: shown}


def _within_the_sine(p: EffectParameter) -> float:
    """A shape parameter within the sine's range, so that e.g. an end stop is reached."""
    return min(p.tried) if p.role == "shape" and p.tried and p.value > 1.0 else p.value
