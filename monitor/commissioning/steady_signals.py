"""Signals of a recording beside the modelled acceleration, and its settled, periodic part."""

import numpy as np

from monitor.commissioning.period import period_of
from monitor.model import (
    TransferPlant,
)
from monitor.signals import Recording, modelled_acceleration
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

CHANNELS = ("voltage", "position", "acceleration")
START_S = 4.0
"""Beginning of a recording that is left out, as filters settle [s]."""


def signals_of(recording: Recording, plant: TransferPlant, rate: float) -> FloatArray:
    """Voltage, position, measured and modelled acceleration, aligned, shape (4, n)."""
    function, delay = modelled_acceleration(plant, rate)
    voltage = recording.channel("voltage")
    late = [np.roll(recording.channel(name), delay) for name in CHANNELS[1:]]
    return np.array([voltage, *late, function.simulate(voltage)])


def steady_of(recording: Recording, plant: TransferPlant, rate: float) -> tuple[FloatArray, int]:
    """Signals of the settled part, and the period [samples].

    Raises:
        ModelError: the voltage has no period of whole samples.
    """
    signals = signals_of(recording, plant, rate)[:, round(START_S * rate) :]
    period = period_of(signals[0], longest=1024) if signals.shape[1] else 0
    if period == 0 or signals.shape[1] < 4 * period:
        raise ModelError(
            f"{recording.name}: found no period in the voltage, expected at least 4 s and four "
            "periods of an excitation that repeats after a whole number of samples"
        )
    return signals, period


def scale_of(mean: FloatArray) -> float:
    """Scale of the modelled acceleration that fits the measured one over an average period."""
    return float(mean[2] @ mean[3] / (mean[3] @ mean[3]))
