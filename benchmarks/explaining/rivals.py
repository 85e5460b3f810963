"""pysindy and SysIdentPy on the recordings of the hidden effects.

pysindy gets the states that the rig has: position and velocity from one smoothing filter, and the
measured acceleration as the derivative to be explained. Its library has every effect that a sum
of fixed terms can express, and four other terms. Sequentially thresholded least squares
(S. L. Brunton, J. L. Proctor, J. N. Kutz, PNAS 113(15), 2016) selects the terms, the held-out
recording selects the threshold, and the largest term beyond the linear model is named.

SysIdentPy gets a polynomial NARX model of position from force (S. A. Billings, Nonlinear System
Identification, 2013) at 64 Hz, terms by forward regression, their number by Akaike's criterion. A
lagged cube of position counts as cubic stiffness and so on; a term of no effect in the list counts
as "unknown".
"""

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import pysindy
from scipy.signal import decimate, savgol_filter
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares
from threadpoolctl import threadpool_limits

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import FloatArray

NOTHING = "nothing_missing"
UNKNOWN = "unknown"

SMOOTHED = 21
"""Samples of the cubic that smooths and differentiates the position."""
THRESHOLDS = np.geomspace(1e-3, 0.3, 24)
"""Share of the acceleration's rms below which a term is dropped."""
AS_GOOD = 1.001
"""Held-out error over the smallest one up to which the model of fewer terms is taken."""
STUCK = 1e-3
"""Speed below which dry friction is proportional to speed, over its rms: as in the library."""
LINEAR = ("x", "v", "force")
TERMS: dict[str, Callable[[FloatArray, FloatArray, FloatArray], FloatArray]] = {
    "constant_force": lambda x, _v, _sign: np.ones_like(x),
    "quadratic_stiffness": lambda x, _v, _sign: x**2,
    "cubic_stiffness": lambda x, _v, _sign: x**3,
    "quadratic_drag": lambda _x, v, _sign: v * np.abs(v),
    "viscous_by_direction": lambda _x, v, _sign: np.abs(v),
    "coulomb": lambda _x, _v, sign: sign,
    "end_binding": lambda x, _v, sign: x**4 * sign,
    "unknown: v^3": lambda _x, v, _sign: v**3,
    "unknown: x|x|": lambda x, _v, _sign: x * np.abs(x),
    "unknown: x v": lambda x, v, _sign: x * v,
    "unknown: x^2 v": lambda x, v, _sign: x**2 * v,
}
"""Terms beyond the linear model, by the effect that they are."""

THINNED = 4
"""Decimation for SysIdentPy: at 256 Hz neighbouring samples differ by little more than noise."""
LAGS = 2
MOST_TERMS = 20


def pysindy_names(train: Recording, held_out: Recording) -> str:
    """The effect of the largest surviving term, or "nothing_missing", or "unknown".

    Args:
        train: one input, force [N]; outputs position [m] and acceleration [m/s^2].
        held_out: the same; selects the threshold.
    """
    with _one_thread():
        columns, wanted = _library(train), _inner(train.outputs[:, 1])
        others, target = _library(held_out), _inner(held_out.outputs[:, 1])
        size = {name: float(np.sqrt(np.mean(c**2))) for name, c in columns.items()}
        a, b = (np.stack([t[n] / size[n] for n in size], axis=1) for t in (columns, others))
        tried = [_sparse(a, wanted, threshold) for threshold in THRESHOLDS]
        errors = [float(np.std(target - b @ found)) for found in tried]
    good = [f for f, e in zip(tried, errors, strict=True) if e <= AS_GOOD * min(errors)]
    fewest = min(good, key=np.count_nonzero)
    return _largest(dict(zip(size, np.abs(fewest).tolist(), strict=True)))


def _sparse(columns: FloatArray, wanted: FloatArray, threshold: float) -> FloatArray:
    """Coefficients of columns of unit rms, those below the threshold dropped."""
    optimizer = pysindy.STLSQ(threshold=threshold * float(np.std(wanted)), alpha=1e-6)
    optimizer.fit(columns, wanted[:, None])
    return np.asarray(optimizer.coef_[0], np.float64)


def _library(recording: Recording) -> dict[str, FloatArray]:
    """Columns by name, without the ends that the smoothing filter spoils."""
    position = recording.outputs[:, 0]
    x = savgol_filter(position, SMOOTHED, 3)
    v = savgol_filter(position, SMOOTHED, 3, deriv=1, delta=recording.dt)
    sign = np.tanh(v / (STUCK * np.sqrt(np.mean(v**2))))
    found = {"x": x, "v": v, "force": recording.inputs[:, 0]}
    found |= {name: term(x, v, sign) for name, term in TERMS.items()}
    return {name: _inner(column) for name, column in found.items()}


def _inner(signal: FloatArray) -> FloatArray:
    return signal[SMOOTHED:-SMOOTHED]


def _largest(contributions: Mapping[str, float]) -> str:
    """Name of the largest nonzero contribution beyond the linear model."""
    extra = {n: size for n, size in contributions.items() if size > 0 and n not in LINEAR}
    return max(extra, key=lambda n: extra[n]).partition(":")[0] if extra else NOTHING


def sysidentpy_names(train: Recording, held_out: Recording) -> str:
    """The effect of the strongest term beyond a linear NARX model; arguments as above."""
    del held_out  # Akaike's criterion needs none
    signals = (train.outputs[:, :1], train.inputs)
    y, u = (_standard(np.asarray(decimate(s, THINNED, axis=0))) for s in signals)
    model = FROLS(
        ylag=LAGS, xlag=LAGS, info_criteria="aic", n_info_values=MOST_TERMS,
        estimator=LeastSquares(), basis_function=Polynomial(degree=3),
    )  # fmt: skip
    with _one_thread():
        model.fit(X=u, y=y)
    sizes: dict[str, float] = {}
    for term, reduction in zip(model.final_model, model.err, strict=False):
        name = _meaning(tuple(int(code) // 1000 for code in term))
        sizes[name] = sizes.get(name, 0.0) + float(reduction)
    return _largest(sizes)


def _standard(signal: FloatArray) -> FloatArray:
    return np.asarray(signal / np.std(signal), np.float64)


def _meaning(factors: tuple[int, ...]) -> str:
    """The effect that a product of lagged signals is; 1 is position, 2 force, 0 nothing."""
    outputs, inputs = factors.count(1), factors.count(2)
    if outputs + inputs == 1:
        return "x"
    if inputs:
        return UNKNOWN
    return ("constant_force", "x", "quadratic_stiffness", "cubic_stiffness")[outputs]


@contextmanager
def _one_thread() -> Iterator[None]:
    """Without warnings, and with one thread: the matrices are too small for more."""
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")
        yield
