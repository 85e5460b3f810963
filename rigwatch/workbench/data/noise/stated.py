"""The noise that a study states for its outputs, as the residual of a recording has it."""

import math

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.study import Study, told, told_unit

MUCH_MORE = 3.0
"""Stated noise, over that of a channel's own quietest band, above which it is remarked on."""


def stated_rms(study: Study, recording: Recording) -> FloatArray:
    """Standard deviation of each output's noise in SI, NaN if not stated, shape (outputs,).

    Args:
        study: its file states the noise of a sample.
        recording: which is decimated or not.
    """
    kept = recording.thinning.kept if recording.thinning else 1.0
    stated = [study.file.noise.get(name, math.nan) for name in study.model.outputs]
    return math.sqrt(kept) * np.array(stated)


def overstated(study: Study, quiet: FloatArray) -> tuple[str, ...]:
    """Remarks on stated noise that a recording does not show.

    Args:
        study: as in `stated_rms`.
        quiet: noise of each channel from its own quietest band, shape (outputs,).
    """
    remarks = []
    for (name, output), seen in zip(study.model.outputs.items(), quiet.tolist(), strict=True):
        size, unit = study.file.noise.get(name, 0.0), told_unit(output)
        if size > MUCH_MORE * seen:
            remarks.append(
                f"noise: {name} = {told(size, unit):.3g} {unit} is stated, and its quietest band"
                f" shows {told(seen, unit):.2g} {unit}: what is missing may pass for noise"
            )
    return tuple(remarks)
