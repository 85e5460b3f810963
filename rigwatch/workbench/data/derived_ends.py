"""Ends of a recording, where derived signals stand on samples that were never measured.

A low-pass of zero phase continues a signal beyond its ends by extrapolation, and a derivative
magnifies the error: the last samples of a derived speed may be wrong a hundred times as much as the
others. A model that it drives, or that is compared with it, fails there, and no effect explains
that.
"""

import numpy as np

from rigwatch.physics.engine.equations import Input, Output
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.study import Study

PERIODS = 2.0
"""Length of an end, in periods of the low-pass's corner."""
MOST = 0.1
"""Largest share of a recording that an end takes."""


def without_ends(study: Study, outputs: FloatArray, dt: float) -> FloatArray:
    """Outputs of a recording, NaN at its ends: derived ones, or all if derived signals drive them.

    Args:
        study: the study; the residual of a thinned one has ends of its own.
        outputs: as measured, shape (samples, outputs).
        dt: time between samples [s].
    """
    derive = study.file.derive
    if derive is None or study.file.thin is not None:
        return outputs
    driven = any(_is_derived(study, name, one) for name, one in study.model.inputs.items())
    wrong = [driven or _is_derived(study, name, one) for name, one in study.model.outputs.items()]
    edge = min(round(PERIODS / (derive.low_pass * dt)), int(MOST * len(outputs)))
    counted = np.arange(len(outputs))
    end = (counted < edge) | (counted >= len(outputs) - edge)
    return np.where(np.outer(end, wrong), np.nan, outputs)


def _is_derived(study: Study, name: str, signal: Input | Output) -> bool:
    derive = study.file.derive
    return derive is not None and study.file.channel_of(name, signal) in derive.signals
