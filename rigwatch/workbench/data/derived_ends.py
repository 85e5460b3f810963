"""Ends of a recording, where derived signals stand on samples that were never measured.

A low-pass of zero phase continues a signal beyond its ends by extrapolation, and a derivative
magnifies the error: the last samples of a derived speed may be wrong a hundred times as much as the
others. A model that it drives fails there, and no effect explains that.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.study import Study

PERIODS = 2.0
"""Length of an end, in periods of the low-pass's corner."""
MOST = 0.1
"""Largest share of a recording that an end takes."""


def without_ends(study: Study, outputs: FloatArray, dt: float) -> FloatArray:
    """Outputs of a recording, NaN at its ends if derived signals drive the model.

    Args:
        study: the study; the residual of a thinned one has ends of its own.
        outputs: as measured, shape (samples, outputs).
        dt: time between samples [s].
    """
    file, derive = study.file, study.file.derive
    inputs = study.model.inputs.items()
    driving = {file.channels.get(name, own.channel or name) for name, own in inputs}
    if derive is None or file.thin is not None or not driving & derive.signals.keys():
        return outputs
    edge = min(round(PERIODS / (derive.low_pass * dt)), int(MOST * len(outputs)))
    counted = np.arange(len(outputs))
    inside = (counted >= edge) & (counted < len(outputs) - edge)
    return np.where(inside[:, None], outputs, np.nan)
