"""The change that an effect has to explain, and what an effect at a port would cause in it.

Two signals tell of it, each in units of its noise: the change of the model's residual, and, where a
position and an accelerometer are measured, how far the two differ (`sensor_agreement.py`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from monitor.diagnosis.rig_ports import RigPorts
from monitor.diagnosis.sensor_agreement import HALF_WIDTH, SensorAgreement, sensor_agreement
from monitor.model import RigModel, TransferPlant
from rigwatch.physics.engine.fit import filled
from rigwatch.wire.arrays import BoolArray, FloatArray

SETTLED = 0.25
"""Time from the onset until effects have built up [s]."""
MODEL_ERROR = 0.1
"""Error of a model's response relative to the signal, if no healthy reference tells it."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Samples around an alarm.

    Attributes:
        signals: the model's channels, NaN if invalid, shape (n, channels).
        change: of the residual against the healthy rig [m/s^2], shape (n,).
        onset: row at which the change began.
    """

    signals: FloatArray
    change: FloatArray
    onset: int

    @cached_property
    def bridged(self) -> FloatArray:
        """The signals with their holes filled, shape (n, channels)."""
        return np.stack([filled(signal) for signal in self.signals.T], axis=1)


class ObservedChange:
    """The change over the rows that count.

    Args:
        evidence: the samples.
        model: the current model.
        ports: of the rig, over the same samples.

    Attributes:
        rows: those that count, shape (n,).
        values: the change in units of its noise, shape (rows, signals).
    """

    def __init__(self, evidence: Evidence, model: RigModel, ports: RigPorts) -> None:
        self._ports, self._noise = ports, model.noise.residual
        self._agreement = _agreement(evidence, model)
        self.rows = _counted(evidence, model)
        residual = (evidence.change - ports.known) / self._noise
        signals = [residual]
        if self._agreement is not None:
            self.rows[:HALF_WIDTH] = self.rows[-HALF_WIDTH:] = False
            signals.append(self._agreement.difference / self._agreement.noise)
        self.values = np.stack(signals, axis=1)[self.rows]

    @property
    def noise_share(self) -> float:
        """Share of the energy that is noise."""
        return self.values.size / max(float(np.sum(self.values**2)), 1e-300)

    def caused(self, port: str, push: FloatArray) -> FloatArray:
        """The change that an effect causes, shape (rows, signals).

        Args:
            port: where it is.
            push: what it adds there, shape (n,).
        """
        moved = [self._ports.responses[port](push.copy()) / self._noise]
        if self._agreement is not None:
            sensor = port == "acceleration_sensor"
            differs = self._agreement.response(push) / self._agreement.noise
            moved.append(differs if sensor else np.zeros(len(push)))
        return np.stack(moved, axis=1)[self.rows]


def _agreement(evidence: Evidence, model: RigModel) -> SensorAgreement | None:
    if not isinstance(model.plant, TransferPlant):
        return None  # its acceleration is that of the position
    _, position, acceleration = evidence.bridged.T
    whole = np.asarray(np.isfinite(evidence.signals).all(axis=1))
    return sensor_agreement(position, acceleration, whole, evidence.onset, model.sample_rate)


def _counted(evidence: Evidence, model: RigModel) -> BoolArray:
    """Rows whose change the directions can be held against: effects have built up since the onset,
    and filters have settled since the last hole in the signals.
    """
    settled, count = round(SETTLED * model.sample_rate), len(evidence.change)
    missing = ~np.isfinite(evidence.signals).all(axis=1)
    lately = np.convolve(missing, np.ones(max(model.decision.settle, 1)))[:count]
    since_onset = np.arange(count) >= evidence.onset + settled
    whole = lately <= model.decision.longest_hold
    return np.asarray(since_onset & whole & np.isfinite(evidence.change))


def model_error(model: RigModel) -> float:
    """Error of the model's response relative to the signal: what it leaves of healthy references.

    What an effect causes passes through the same response, so it is known no better.
    """
    left = [
        float(np.std(np.subtract(one.acceleration, one.modelled)) / np.std(one.acceleration))
        for one in model.reference
    ]
    return max(left, default=MODEL_ERROR)
