"""Samples at discontinuities of an effect, where the sampled error is not meaningful.

Dry friction changes sign instantly when the motion reverses. A model that is late by a hundredth of
a sample may evaluate the acceleration on the wrong side of the jump, which makes the error at that
sample as large as the jump. In a correct model with little noise such samples dominate the error.
"""

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.fit import Fit, Recording, initial_states, seen, windows
from rigwatch.wire.arrays import BoolArray

JUMP = 0.5
"""Change per sample, relative to the largest value of the effect, that counts as a jump."""
MOST = 0.3
"""Share of samples beside jumps above which they are normal behaviour, not discontinuities."""


def between_jumps(fitted: Fit, recording: Recording, horizon: int) -> BoolArray | None:
    """Samples of a recording's windows away from jumps, shape (windows, length).

    Args:
        fitted: a model with effects.
        recording: the recording it is judged on.
        horizon: samples of a window.

    Returns:
        None if there are no jumps, or if samples were decimated.
    """
    if recording.thinning is not None:
        return None
    beside = _beside_jumps(fitted, recording)
    if not beside.any() or beside.mean() > MOST:
        return None
    cut = windows(fitted.compiled.system, len(recording), horizon)
    calm: BoolArray = ~beside[cut.starts[:, None] + np.arange(cut.length)]
    return calm


def _beside_jumps(fitted: Fit, recording: Recording) -> BoolArray:
    """Whether an effect without states jumps right before or after a sample, shape (n,)."""
    system, values = fitted.compiled.system, fitted.values()
    beside = np.zeros(len(recording), np.bool_)
    able = [
        placement
        for placement in system.placements
        if system.model.ports[placement.port].kind == "force" and not placement.effect.states
    ]
    if not able:
        return beside
    states = initial_states(system, recording)
    for placement in able:
        effect = placement.effect
        signals = seen(system, placement, recording.inputs, states, recording.dt, values)
        own = {name: values[placement.prefix + name] for name in effect.parameters}
        pushed = evaluated(effect.expression, signals, own, str(placement))
        sudden = np.abs(np.diff(pushed)) > JUMP * np.max(np.abs(pushed))
        beside[:-1] |= sudden
        beside[1:] |= sudden
    return beside
