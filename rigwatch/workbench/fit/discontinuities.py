"""Samples at which an effect jumps, so that a sampled error says little about it.

Dry friction turns round where the motion does, in no time. A model that is late by a hundredth of a
sample may read the acceleration on the wrong side of the jump, and misses that one sample by all of
it: in a right model with little noise such samples hold most of the error.
"""

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.fit import Fit, Recording, initial_states, seen, windows
from rigwatch.wire.arrays import BoolArray

JUMP = 0.5
"""Change from one sample to the next, over the largest that the effect ever is."""
MOST = 0.3
"""Share of samples beside jumps from which it is no jump but how the effect goes."""


def between_jumps(fitted: Fit, recording: Recording, horizon: int) -> BoolArray | None:
    """Samples of a recording's windows that are beside no jump, shape (windows, length).

    Args:
        fitted: a model with effects.
        recording: what it is judged on.
        horizon: samples of a window.

    Returns:
        None where nothing jumps, or samples were thinned.
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
    """Whether an effect without memory changes at once before or after a sample, shape (n,)."""
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
