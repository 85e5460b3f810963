"""Parity equations: the residuals of a linear model (Höfling and Deibert 1994).

    r_ARMA = y - G(q⁻¹)·u                (thesis 2.45)      G = B/A
    r_MA   = A(q⁻¹)·y - B(q⁻¹)·u         (thesis 2.46)

    u, y   small signals: input and output with the operating point removed [input, output unit]
    r      residual [output unit]

A constant fault Δy on the output and Δu on the input shows as Δy - G(1)·Δu in the first (2.50) and
as A(1)·Δy - B(1)·Δu in the second (2.51), up to the sign convention of the fault. Here faults add
to the readings (y → y + Δy, u → u + Δu), which gives these very signs. The ARMA residual runs a
model in parallel and depends on all past samples; the MA residual depends on the last samples only,
reacts at once, and amplifies noise.

The operating point is either given, or followed by a first-order high-pass of both signals; linear
filters commute, so the high-pass preserves the residual's meaning, and constant faults decay with
its time constant. The residual is high-passed once more: the model of an integrating plant, such as
the rig, never forgets its initial state; this removes it. Each
residual is judged by an adaptive threshold.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.detectors.adaptive_threshold import (
    AdaptiveThreshold,
    ThresholdState,
    new_threshold_state,
    threshold_sample,
)
from monitor.detectors.detector import Channels, Judgement, SampleDetector, Series
from monitor.detectors.high_pass import decay_factor
from monitor.signals import DEAD, HELD, NEW_BOOT, RESTART, fill
from rigwatch.physics.transfer import TransferFunction, filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel, part


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """The operating point subtracted from input and output.

    Attributes:
        corner: corner of the high-pass that follows the operating point [Hz]; 0 for a given one.
        u0: input at the operating point [input unit], for corner 0.
        y0: output at the operating point [output unit], for corner 0.
        settle: samples after a start that are not judged [1].
    """

    corner: float = 0.0
    u0: float = 0.0
    y0: float = 0.0
    settle: int = 0


class ParityState(NamedTuple):
    """State of one parity residual.

    Attributes:
        output, input: state of the filters of y and u.
        point: last (u, y), the same high-passed, last residual and the same high-passed,
            shape (6,).
        threshold: state of the adaptive threshold.
        counts: samples since the start; samples since the last held one, shape (2,).
    """

    output: FloatArray
    input: FloatArray
    point: FloatArray
    threshold: ThresholdState
    counts: NDArray[np.int64]


def _new_state(order: int) -> ParityState:
    filters = np.zeros(max(order, 1)), np.zeros(max(order, 1))
    return ParityState(*filters, np.zeros(6), new_threshold_state(), np.zeros(2, np.int64))


@part()
def small_signal(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    forget: float, u0: float, y0: float, state: ParityState, u: float, y: float
) -> None:
    """Subtract the operating point; the results are in `state.point[2:4]`."""
    point = state.point
    if forget == 1.0:
        point[2], point[3] = u - u0, y - y0
    elif state.counts[0] == 0:
        point[2], point[3] = 0.0, 0.0
    else:
        point[2] = forget * (point[2] + u - point[0])
        point[3] = forget * (point[3] + y - point[1])
    point[0], point[1] = u, y


@part()
def _remove_initial_state(forget: float, state: ParityState, residual: float) -> float:
    """The residual without the effect of the model's initial state."""
    if forget == 1.0:
        return residual
    point = state.point
    point[5] = forget * (point[5] + residual - point[4])
    point[4] = residual
    return float(point[5])


@part()
def _restart(state: ParityState) -> None:
    fill(state.output, 0.0)
    fill(state.input, 0.0)
    fill(state.point, 0.0)
    fill(state.threshold.memory, 0.0)
    fill(state.counts, 0)


@kernel(allocates=True)
def parity_block(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    moving_average: bool,
    function: tuple[FloatArray, FloatArray],
    threshold: FloatArray,
    point: FloatArray,
    state: ParityState,
    signals: FloatArray,
    code: NDArray[np.int64],
) -> tuple[FloatArray, FloatArray]:
    """Residual and limit of consecutive samples; NaN if not judged.

    Args:
        moving_average: r_MA in place of r_ARMA.
        function: (b, a), of one length.
        threshold: coefficients of the adaptive threshold.
        point: (high-pass coefficient, u0, y0, settle).
        state: carried on.
        signals: input and output, shape (n, 2).
        code: of admission, shape (n,).
    """
    b, a = function
    one = np.zeros(a.size)
    one[0] = 1.0
    residual, limit = np.full(code.size, np.nan), np.full(code.size, np.nan)
    for k in range(code.size):
        if code[k] == DEAD:
            continue
        if code[k] == RESTART or code[k] == NEW_BOOT:
            _restart(state)
        small_signal(point[0], point[1], point[2], state, signals[k, 0], signals[k, 1])
        u, y = state.point[2], state.point[3]
        if moving_average:
            r = filter_sample(a, one, state.output, y) - filter_sample(b, one, state.input, u)
        else:
            r = _remove_initial_state(point[0], state, y - filter_sample(b, a, state.input, u))
        bound = threshold_sample(threshold, state.threshold, u)
        state.counts[0] += 1
        state.counts[1] = 0 if code[k] == HELD else state.counts[1] + 1
        remembers = moving_average and state.counts[1] < a.size
        if code[k] != HELD and state.counts[0] > point[3] and not remembers:
            residual[k], limit[k] = r, bound
    return residual, limit


class ParityDetector(SampleDetector):
    """One parity residual with its adaptive threshold.

    Args:
        function: the model G from input to output.
        threshold: of the residual.
        point: how the operating point is found.
        channels: input and output.
        sample_rate: [Hz].
        moving_average: r_MA in place of r_ARMA.

    Raises:
        ModelError: G is unstable, so that the parallel model would diverge.
    """

    def __init__(
        self,
        function: TransferFunction,
        threshold: AdaptiveThreshold,
        point: OperatingPoint,
        channels: Channels,
        sample_rate: float,
        *,
        moving_average: bool,
    ) -> None:
        if not (moving_average or function.is_stable):
            raise ModelError("ARMA parity residual: found an unstable model, expected a stable one")
        name = "parity_ma" if moving_average else "parity_arma"
        super().__init__(name, (channels.input, channels.output))
        self._moving_average, self._function = moving_average, function.padded()
        self._threshold = threshold.coefficients(sample_rate)
        forget = decay_factor(point.corner, sample_rate)
        self._point = np.array([forget, point.u0, point.y0, float(point.settle)])
        self._state = _new_state(self._function[0].size - 1)

    def judge(self, signals: FloatArray, code: NDArray[np.int64]) -> Judgement:
        """Residual against ± limit."""
        residual, limit = parity_block(
            self._moving_average,
            self._function,
            self._threshold,
            self._point,
            self._state,
            signals,
            code,
        )
        series = (
            Series(f"{self.condition}_residual", "m", residual),
            Series(f"{self.condition}_limit", "m", limit),
        )
        return Judgement(series, residual, -limit, limit)
