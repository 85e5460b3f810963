"""Sensors whose faults cannot explain the recordings: under the same drive others read otherwise.

A sensor's fault changes what that sensor reads. As long as the recorded inputs stay the same the
machine moves as before, and all other sensors read as before. Where one of these reads much more
or less than on the healthy rig, the motion itself has changed. In a loop that is closed over the
faulty sensor the inputs change with the motion, and nothing follows.
"""

from collections.abc import Iterator

import numpy as np
from scipy.signal import correlate

from rigwatch.physics.engine.fit import Recording, apart
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.workbench.data import Data, bridged
from rigwatch.workbench.study import Study

CHANGED = 1.5
"""Ratio of a channel's rms to that of the healthy rig above which, or below whose inverse, it has
changed."""
SAME = 0.05
"""Largest difference of inputs that count as the same, over their standard deviation (rms)."""
LEAST = 0.5
"""Share of the shorter recording that two recordings under the same drive have in common."""
DRIVEN = 1e-3
"""Share of the strongest line's power above which a frequency is driven."""


def denied_sensors(study: Study, data: Data) -> dict[str, str]:
    """Why no fault at a sensor's port alone explains the recordings, by port.

    Empty without a healthy recording under the same drive, and once effects are in the model: they
    may be what changed the motion.

    Args:
        study: its model, as it is or along its measured motion.
        data: recordings for that model.
    """
    if data.healthy is None or study.file.effects:
        return {}
    drive = slice(data.train.driving)
    for healthy, test in _pairs(data.healthy, data.train, drive):
        band = _driven(healthy.inputs[:, drive], test.inputs[:, drive])
        if band is not None:
            before, after = (_sizes(study, data, each, band) for each in (healthy, test))
            ratios = {port: after[port] / before[port] for port in before if before[port] > 0.0}
            return _denied(study, data, ratios)
    return {}


def _denied(study: Study, data: Data, ratios: dict[str, float]) -> dict[str, str]:
    """The reasons, given the ratio of rms to that of the healthy rig at each sensor's port."""
    changed = {port: r for port, r in ratios.items() if not 1 / CHANGED <= r <= CHANGED}
    ports = [name for name, port in study.model.ports.items() if port.kind == "sensor"]
    found = {}
    for own in (*ports, *(sensor.port for sensor in data.motion)):
        other = next((port for port in changed if port != own), None)
        if other is not None:
            found[own] = (
                f"{other} reads {changed[other]:.2g} times as much as on the healthy rig under the"
                " same drive, which a fault here does not cause; not fitted"
            )
    return found


def _pairs(
    healthy: Recording, test: Recording, drive: slice
) -> Iterator[tuple[Recording, Recording]]:
    """What every healthy recording shares with every other one, shifted to where drives agree."""
    for one in apart(healthy):
        for other in apart(test):
            ahead = _shift(one.inputs[:, drive], other.inputs[:, drive])
            first, second = max(ahead, 0), max(-ahead, 0)
            n = min(len(one) - first, len(other) - second)
            if n >= LEAST * min(len(one), len(other)):
                yield one.stretch(first, first + n), other.stretch(second, second + n)


def _shift(healthy: FloatArray, test: FloatArray) -> int:
    """Samples by which a drive, (n, inputs), comes later in the healthy recording."""
    found = np.zeros(len(healthy) + len(test) - 1)
    for one, other in zip(healthy.T, test.T, strict=True):
        if (size := one.std() * other.std()) > 0.0:
            found += correlate(one - one.mean(), other - other.mean(), method="fft") / size
    return int(np.argmax(found)) - (len(test) - 1)


def _driven(healthy: FloatArray, test: FloatArray) -> BoolArray | None:
    """The driven frequencies if both drives, shape (n, inputs), are the same; otherwise None."""
    changing = healthy.std(axis=0)
    different = np.sqrt(np.mean((test - healthy) ** 2, axis=0)) > SAME * changing
    if not changing.any() or different.any():
        return None
    lines = _spectra(healthy - healthy.mean(axis=0))
    power = np.sum((lines / np.maximum(lines.max(axis=0), 1e-300)) ** 2, axis=1)
    return np.asarray(power > DRIVEN * power.max())


def _spectra(signals: FloatArray) -> FloatArray:
    """Amplitudes of signals of shape (n, channels), (frequencies, channels)."""
    window = np.hanning(len(signals))[:, None]
    return np.asarray(np.abs(np.fft.rfft(window * signals, axis=0)))


def _sizes(study: Study, data: Data, recording: Recording, band: BoolArray) -> dict[str, float]:
    """Size of what the sensors read at the driven frequencies, by port.

    A signal derived from a channel shows the fault of that channel's sensor, and does not count.
    """
    model, file = study.model, study.file
    derived = file.derive.signals if file.derive else {}
    outputs = list(model.outputs)
    read = {sensor.port: recording.inputs[:, sensor.position] for sensor in data.motion}
    for name, port in model.ports.items():
        if port.kind != "sensor" or port.signal not in outputs:
            continue
        if file.channel_of(port.signal, model.outputs[port.signal]) not in derived:
            read[name] = bridged(recording.outputs[:, outputs.index(port.signal)])
    return {
        port: float(np.sqrt(np.sum(_spectra((x - x.mean())[:, None])[band] ** 2)))
        for port, x in read.items()
    }
