"""The friction filter from recordings in which a known friction begins (5.29)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.commissioning.friction_filter import FrictionFilter, fit_friction_filter
from monitor.commissioning.period import averaged
from monitor.commissioning.steady_signals import START_S, scale_of, steady_of
from monitor.model import (
    TransferPlant,
    VelocitySection,
)
from monitor.signals import Recording
from rigwatch.physics.transfer import (
    velocity_filter,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class _Onset:
    """Velocity (zero before the onset) and change of the residual around a known fault's onset."""

    velocity: FloatArray
    change: FloatArray


def friction_filter_of(
    recordings: Sequence[Recording],
    plant: TransferPlant,
    velocity: VelocitySection,
    rate: float,
    around: tuple[int, int],
) -> FrictionFilter:
    """The friction filter: one per recording is fitted, and the best for all of them is used.

    Args:
        recordings: healthy at first, then with a friction that begins.
        plant: friction-free.
        velocity: filter of the speed.
        rate: sample rate [Hz].
        around: samples before and after the onset that are used.

    Raises:
        ModelError: a recording shows no friction, or from its beginning on.
    """
    onsets = [_onset(recording, plant, velocity, rate, around) for recording in recordings]
    fits = [fit_friction_filter(onset.velocity, onset.change, skip=0) for onset in onsets]
    return min(fits, key=lambda fit: sum(_unexplained(fit, onset) for onset in onsets))


def _unexplained(fit: FrictionFilter, onset: _Onset) -> float:
    """Share of the change's energy that the filter leaves, with free strength."""
    model = fit.function.simulate(np.sign(onset.velocity) + fit.gamma * onset.velocity)
    strength = (model @ onset.change) / (model @ model)
    left = onset.change - strength * model
    return float((left @ left) / (onset.change @ onset.change))


def _onset(
    recording: Recording,
    plant: TransferPlant,
    velocity: VelocitySection,
    rate: float,
    around: tuple[int, int],
) -> _Onset:
    signals, period = steady_of(recording, plant, rate)
    function = velocity_filter(velocity.corner, rate, velocity.sensor_corner)
    speed = function.simulate(recording.channel("acceleration"))[round(START_S * rate) :]
    change, begin = _change(recording, signals, period, rate)
    speed = np.where(np.arange(speed.size) >= begin, speed, 0.0)
    part = slice(max(begin - around[0], 0), begin + around[1])
    return _Onset(speed[part], change[part])


def _change(
    recording: Recording, signals: FloatArray, period: int, rate: float
) -> tuple[FloatArray, int]:
    """Change of the residual against the recording's own healthy start, and its onset [sample]."""
    beginning = max(4, round(rate / period)) * period
    found = averaged(signals[:, :beginning], period)
    scale = scale_of(found.mean)
    residual = signals[2] - scale * signals[3]
    healthy = np.resize(found.mean[2] - scale * found.mean[3], residual.size)
    change = residual - healthy
    noise = averaged(residual[None, :beginning], period).scatter[0]
    departed = np.flatnonzero(np.abs(change) > 8.0 * noise)
    late = departed[departed >= beginning]
    if late.size == 0:
        raise ModelError(
            f"{recording.name}: found no change in the residual, expected a friction fault"
        )
    if departed[0] < beginning:
        raise ModelError(
            f"{recording.name}: found a residual that is not steady in the first "
            f"{beginning / rate + START_S:.1f} s, expected the fault to begin later"
        )
    return change, int(late[0])
