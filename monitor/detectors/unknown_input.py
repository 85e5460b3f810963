"""Detects and estimates a bias of the position sensor by the filters of `unknown_input_filters`."""

import numpy as np
from numpy.typing import NDArray

from monitor.detectors.detector import Channels, Judgement, SampleDetector, Series
from monitor.detectors.high_pass import decay_factor, leaky
from monitor.detectors.small_matrices import (
    inverse,
)
from monitor.detectors.unknown_input_filters import (
    NoiseModel,
    filter_model,
    new_filter_state,
    unknown_input_block,
)
from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


class UnknownInputDetector(SampleDetector):
    """The two filters on a rig's transfer function.

    Args:
        function: the model from input to output, at least one sample of delay.
        noise: variances and the test's limit.
        channels: input, output and, unless "", acceleration.
        sample_rate: [Hz].

    Raises:
        ModelError: the model or the noise is unsuitable.
    """

    def __init__(
        self,
        function: TransferFunction,
        noise: NoiseModel,
        channels: Channels,
        sample_rate: float,
    ) -> None:
        with_acceleration = bool(channels.acceleration)
        names = (channels.input, channels.output)
        super().__init__(
            "unknown_input", (*names, channels.acceleration) if with_acceleration else names
        )
        self._noise = noise
        self._traits = (noise.settle, decay_factor(noise.corner, sample_rate))
        if noise.corner > 0.0:
            function = leaky(function, noise.corner, sample_rate)
        self._model = filter_model(
            function, noise, sample_rate, with_acceleration=with_acceleration
        )
        if not inverse(self._model.w, np.empty_like(self._model.w)):
            raise ModelError("unknown-input Kalman filter: found a singular state covariance")
        self._state = new_filter_state(self._model, noise.window)

    @property
    def resets(self) -> int:
        """How often the filters failed and were restarted."""
        return int(self._state.counts[1])

    def judge(self, signals: FloatArray, code: NDArray[np.int64]) -> Judgement:
        """Sum of normalised innovations against its limit, and the bias."""
        bias, total = unknown_input_block(self._model, self._state, self._traits, signals, code)
        limit = np.where(np.isnan(total), np.nan, self._noise.limit)
        series = (
            Series("unknown_input_bias", "m", bias),
            Series("unknown_input_nis", "", total),
            Series("unknown_input_limit", "", limit),
        )
        return Judgement(series, total, np.full(code.size, -np.inf), limit)
