"""Samples at discontinuities of an effect, where the sampled error is not meaningful.

Dry friction changes sign instantly when the motion reverses. A model that is late by a hundredth of
a sample may evaluate the acceleration on the wrong side of the jump, which makes the error at that
sample as large as the jump. In a correct model with little noise such samples dominate the error.
"""

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.fit import Fit, Recording, initial_states, port_signals, windows
from rigwatch.wire.arrays import BoolArray

JUMP = 0.5
"""Change per sample, relative to the largest value of the effect, that counts as a jump."""
MOST = 0.3
"""Share of samples next to jumps above which they are normal behaviour, not discontinuities."""


def away_from_jumps(fitted: Fit, recording: Recording, horizon: int) -> BoolArray | None:
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
    near = _near_jumps(fitted, recording)
    if not near.any() or near.mean() > MOST:
        return None
    cut = windows(fitted.compiled.system, len(recording), horizon)
    calm: BoolArray = ~near[cut.starts[:, None] + np.arange(cut.length)]
    return calm


def _near_jumps(fitted: Fit, recording: Recording) -> BoolArray:
    """Whether an effect without states jumps right before or after a sample, shape (n,)."""
    system, values = fitted.compiled.system, fitted.values()
    near = np.zeros(len(recording), np.bool_)
    able = [
        placement
        for placement in system.placements
        if system.model.ports[placement.port].kind == "force" and not placement.effect.states
    ]
    if not able:
        return near
    states = initial_states(system, recording)
    for placement in able:
        effect = placement.effect
        signals = port_signals(
            system, placement, recording.inputs, states, recording.time, recording.spacing, values
        )
        own = {name: values[placement.prefix + name] for name in effect.parameters}
        pushed = evaluated(effect.expression, signals, own, str(placement))
        sudden = np.abs(np.diff(pushed)) > JUMP * np.max(np.abs(pushed))
        near[:-1] |= sudden
        near[1:] |= sudden
    return near
