"""Subtracts a rough model's residual on a healthy rig from that on a recording.

A linear black box leaves a tenth of the acceleration unexplained, which could be mistaken for
missing friction. Under the same excitation this residual repeats from run to run. A healthy
recording with the same excitation therefore gives a reference that is added to the model's outputs,
before the sensors:

    r(k) = mean over healthy periods of (y_h - model(u_h))(k mod T),   T: the period

It enters the model as additional inputs.

The noise floor is the residual of each healthy period with the others as its reference, which
includes the noise of the reference.
"""

from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from scipy.signal import correlate

from rigwatch.physics.engine.equations import Input, Model
from rigwatch.physics.engine.fit import Recording, evaluate
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, find_period
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.study import Study

MAX_DIFFERENCE = 0.2
"""Largest rms difference between an excitation and the healthy one, over its standard deviation."""
DRIFT, CLOCK = 0.25, 1e-3
"""Samples by which rounded periods may be off at the end of a recording, and their relative
difference from the stated ones that may be the clock's."""
FEWEST = 2
"""Number of healthy periods needed, so that each can be compared with another."""


@dataclass(frozen=True, eq=False)
class _Periods:
    """Healthy periods that match a recording's first.

    Attributes:
        inputs: shape (periods, samples, inputs).
        outputs, left: measured, and the model's residual, shape (periods, samples, outputs).
    """

    inputs: FloatArray
    outputs: FloatArray
    left: FloatArray


def with_healthy_reference(
    study: Study, data: Data, scale: FloatArray | None = None
) -> tuple[Study, Data]:
    """A rough model with its healthy residual added as input, and the recordings with that input.

    Args:
        study: with parameters from the healthy recording, see `with_healthy_parameters`.
        data: its recordings.
        scale: divisor of each output's residuals, shape (outputs,).

    Raises:
        ModelError: there is no healthy recording, or none with this excitation.
    """
    if not study.model.rough:
        return study, data
    name = study.model.name
    alone = data.of_healthy
    if alone is None:
        raise ModelError(
            f"{name}: found no healthy recording, expected one with the same excitation,"
            " as this model leaves a large residual on a healthy rig, too"
        )
    # Without the accepted effects: the healthy recording has nothing for them to explain.
    bare = fit_model(study, alone, (), study.file.start, scale, multi_start=True)
    periods = _matching(study, bare, data.train, data, "train")
    judged = _matching(study, bare, data.held_out, data, "held_out")
    remark = f"{name}: its mean residual over {len(judged.left)} healthy periods is added to it"
    return replace(study, model=_with_inputs(study.model)), replace(
        data,
        train=_with_reference(data.train, np.nanmean(periods.left, axis=0)),
        held_out=_with_reference(data.held_out, np.nanmean(judged.left, axis=0)),
        healthy=_leave_one_out(alone.train, judged),
        remarks=(*data.remarks, remark),
    )


def _matching(study: Study, bare: Fitted, recording: Recording, data: Data, use: str) -> _Periods:
    healthy, horizon = data.healthy, data.horizon
    assert healthy is not None
    period = (
        _whole_periods(study.file.period / recording.dt, horizon, len(recording))
        or find_period(recording)
        or len(recording)
    )
    if period % horizon:
        raise ModelError(
            f"{use}: found a period of {period} samples, expected a multiple of the horizon"
            f" of {horizon}"
        )
    starts = _starts(recording.inputs[:period], healthy.inputs)
    if len(starts) < FEWEST:
        raise ModelError(
            f"{use}: found its excitation {len(starts)} times in the healthy recording, expected"
            f" at least {FEWEST}"
        )
    rows = starts[:, None] + np.arange(period)
    left = [_left(bare, healthy, row, horizon) for row in rows]
    return _Periods(healthy.inputs[rows], healthy.outputs[rows], np.array(left))


def _whole_periods(period: float, horizon: int, samples: int) -> int:
    """Samples of as many periods as are whole horizons; 0 if no number of them is.

    Rounded, they come too early or late by more and more in a recording: the first number of
    periods counts for which that is `DRIFT` at its end at most, else the best of `CLOCK`.

    Args:
        period: in samples, not whole in general; 0 if it is not known.
        horizon: samples of a window.
        samples: of the recording.
    """
    if period <= 0.0:
        return 0
    several = period * np.arange(1, int(samples / period) + 1)
    whole = np.rint(several)
    off = np.where(whole % horizon == 0, np.abs(whole - several) / several, np.inf)
    if not np.any(off <= CLOCK):
        return 0
    first = np.flatnonzero(off <= max(DRIFT / samples, off.min()))[0]
    return int(whole[first])


def _starts(period: FloatArray, signals: FloatArray) -> FloatArray:
    """Samples of longer signals at which the period begins, shape (times found,).

    Args:
        period: all inputs, shape (n, inputs); those that do not change are not compared.
        signals: the same of the healthy recording, shape (longer, inputs).
    """
    length, changing = len(period), np.flatnonzero(np.ptp(period, axis=0) > 0.0)
    if len(signals) < length or not len(changing):
        return np.zeros(0, dtype=np.int64)
    each = [_unlike(period[:, column], signals[:, column]) for column in changing]
    unlike = np.max(each, axis=0)
    found: list[int] = []
    for start in np.argsort(unlike):
        if unlike[start] > MAX_DIFFERENCE**2:
            break
        if all(abs(int(start) - other) >= length for other in found):
            found.append(int(start))
    return np.array(sorted(found), dtype=np.int64)


def _unlike(period: FloatArray, signal: FloatArray) -> FloatArray:
    """Mean square difference from a longer signal by where the period begins, over its variance.

    About its mean: an input that moves little about a large value is like any other one there.
    """
    length, mean = len(period), float(period.mean())
    own, signal = period - mean, signal - mean
    squares = np.concatenate([[0.0], np.cumsum(signal**2)])
    energy = squares[length:] - squares[:-length]
    size = float(own @ own)
    return np.asarray((energy + size - 2 * correlate(signal, own, mode="valid")) / size)


def _left(bare: Fitted, healthy: Recording, row: FloatArray, horizon: int) -> FloatArray:
    part = _of_samples(healthy, healthy.inputs[row], healthy.outputs[row])
    residuals = evaluate(bare.train, part, horizon, bare.substeps).residuals
    return np.asarray(residuals.reshape(len(row), -1))


def _of_samples(recording: Recording, inputs: FloatArray, outputs: FloatArray) -> Recording:
    """One stretch of other samples, which are what the recording's are."""
    return Recording(
        recording.dt, inputs, outputs, passed=recording.passed, derived=recording.derived
    )


def _with_inputs(model: Model) -> Model:
    """The model with an input added to each output."""
    inputs = {
        f"unexplained_{name}": Input(unit=o.unit, hold="linear")
        for name, o in model.outputs.items()
    }
    outputs = {
        name: structs.replace(output, expression=f"({output.expression}) + {added}")
        for (name, output), added in zip(model.outputs.items(), inputs, strict=True)
    }
    return structs.replace(model, inputs=model.inputs | inputs, outputs=outputs)


def _with_reference(recording: Recording, reference: FloatArray) -> Recording:
    """The recording with a periodic reference as additional inputs."""
    shown = reference[np.arange(len(recording)) % len(reference)]
    return replace(
        recording,
        inputs=np.column_stack([recording.inputs, np.nan_to_num(shown)]),
        driving=recording.inputs.shape[1],
        outputs=np.where(np.isfinite(shown), recording.outputs, np.nan),
    )


def _leave_one_out(healthy: Recording, periods: _Periods) -> Recording:
    """Each healthy period with the mean residual of the others as its reference."""
    count = len(periods.left)
    others = (np.sum(periods.left, axis=0) - periods.left) / (count - 1)
    inputs, outputs, flat = (
        a.reshape(-1, a.shape[-1]) for a in (periods.inputs, periods.outputs, others)
    )
    return _with_reference(_of_samples(healthy, inputs, outputs), flat)
