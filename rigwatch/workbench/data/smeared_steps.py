"""Readings that follow the steps of a held input at once, in samples that were interpolated.

An import puts samples with uneven times on a uniform grid. Where a current jumps with its voltage,
what is read between a sample before the jump and one after it is neither value, and the mean of the
voltage from one point of the grid to the next is no voltage that was applied.
"""

import numpy as np

from rigwatch.physics.engine.equations import Model, names_reached, spelt_out
from rigwatch.wire.arrays import BoolArray, FloatArray

MOST = 0.2
"""Share of samples beside steps from which on the input is no signal of steps."""
ROUNDED = 1e-9
"""Relative change of a value that stays: means of it have rounding errors."""


def beside_steps(model: Model, inputs: FloatArray) -> BoolArray:
    """Samples of each output that do not count, as an input that it follows at once steps there.

    Args:
        model: of the recording.
        inputs: of interpolated samples, shape (n, inputs); NaN where one is missing.

    Returns:
        Shape (n, outputs).
    """
    written = spelt_out(model)
    held = [name for name in model.inputs if model.held(name) == "zero"]
    stepping = {name: _at_steps(inputs[:, list(model.inputs).index(name)]) for name in held}
    beside = np.zeros((len(inputs), len(model.outputs)), np.bool_)
    for index, output in enumerate(written.outputs.values()):
        for name in names_reached(written, output.expression, model.name) & stepping.keys():
            beside[:, index] |= stepping[name]
    return beside


def _at_steps(signal: FloatArray) -> BoolArray:
    """Samples beside a change of a signal that mostly stays; none of one that does not."""
    changes = np.abs(np.diff(signal)) > ROUNDED * np.nanmax(np.abs(signal), initial=0.0)
    beside = np.zeros(len(signal), np.bool_)
    beside[:-1] |= changes
    beside[1:] |= changes
    return beside if beside.mean() <= MOST else np.zeros_like(beside)
