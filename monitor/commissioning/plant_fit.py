"""The friction-free plant from a chirp, and its shift from healthy recordings."""

from collections.abc import Sequence

import numpy as np

from monitor.commissioning.steady_signals import signals_of
from monitor.model import (
    TransferPlant,
)
from monitor.signals import Recording
from rigwatch.physics.transfer import (
    FrequencyResponse,
    fit_transfer_function,
    frequency_response,
)
from rigwatch.wire.errors import ModelError


def fit_plant(chirp: Recording, band: tuple[float, float]) -> TransferPlant:
    """The transfer function from voltage to position, from a chirp (5.16), (5.19).

    Args:
        chirp: the recording.
        band: frequency band of the fit [Hz].
    """
    response = frequency_response(
        chirp.channel("voltage"), chirp.channel("position"), chirp.sample_rate
    )
    function = fit_transfer_function(response.band(*band, least_coherence=0.5))
    return TransferPlant(b=tuple(function.b.tolist()), a=tuple(function.a.tolist()), shift=1)


def sensor_corner(chirp: Recording) -> float:
    """Corner p of the accelerometer's high-pass [Hz]: a/ẍ = jω/(jω + p), with ẍ from the LVDT."""
    response: FrequencyResponse = frequency_response(
        chirp.channel("position"), chirp.channel("acceleration"), chirp.sample_rate
    )
    try:
        lines = response.band(0.8, 5.0, least_coherence=0.9)
    except ModelError:
        return 0.0
    omega = 2.0 * np.pi * lines.frequency
    # The second difference of a sampled position is (2 sin(ωT/2)/T)², a little less than ω².
    curvature = (2.0 * np.sin(omega / lines.sample_rate / 2.0) * lines.sample_rate) ** 2
    corner = np.real(1j * omega * (-curvature / lines.response - 1.0))
    return float(max(np.median(corner) / (2.0 * np.pi), 0.0))


def with_shift(plant: TransferPlant, healthy: Sequence[Recording], rate: float) -> TransferPlant:
    """The model with the shift at which both accelerations agree best (docs/theory.md 1.2).

    Only advances up to Ĝ's own delay are tried: a longer one would delay every alarm, and the
    healthy average absorbs the remaining error.
    """
    leading = int(np.argmax(np.array(plant.b) != 0.0))
    candidates = [TransferPlant(b=plant.b, a=plant.a, shift=shift) for shift in range(leading + 1)]
    return max(candidates, key=lambda plant: sum(_correlation(plant, r, rate) for r in healthy))


def _correlation(plant: TransferPlant, healthy: Recording, rate: float) -> float:
    """Correlation of modelled and measured acceleration, without a recording's first quarter."""
    signals = signals_of(healthy, plant, rate)[:, healthy.channel("voltage").size // 4 :]
    return float(np.corrcoef(signals[2], signals[3])[0, 1])
