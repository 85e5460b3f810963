"""Commissioning of the friction scheme: recordings in, one model file out.

chirp or multisine, no friction ──▶ Ĝ (5.16), (5.19); corner of the accelerometer
healthy reference(s)            ──▶ shift, amplitude scale, one healthy period, noise
known friction                  ──▶ friction filter Ge and γf (5.29)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.commissioning.known_friction import friction_filter_of
from monitor.commissioning.period import averaged, period_of
from monitor.commissioning.plant_fit import fit_plant, sensor_corner, with_shift
from monitor.commissioning.repeated_readings import chance_of_repeat
from monitor.commissioning.steady_signals import CHANNELS, START_S, scale_of, steady_of
from monitor.model import (
    DecisionSection,
    FrictionSection,
    NoiseSection,
    RecordingSection,
    ReferenceSection,
    RigModel,
    TransferPlant,
    VelocitySection,
    WindowSection,
)
from monitor.signals import Recording, Role, modelled_acceleration
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True)
class CommissionSettings:
    """Settings of commissioning.

    Args:
        band: frequency band of the transfer function's fit [Hz].
        velocity_corner: of the high-pass before the integrator [Hz].
        window, hop: of the windowed least squares [samples].
        before, after: samples before and after the onset used to fit the friction filter.
    """

    band: tuple[float, float] = (1.0, 14.0)
    velocity_corner: float = 0.5
    window: int = 32
    hop: int = 1
    before: int = 64
    after: int = 512


def commission(
    recordings: Sequence[Recording], settings: CommissionSettings | None = None
) -> RigModel:
    """The model of a rig from its commissioning recordings, at least one of each role.

    Raises:
        ModelError: a recording is missing, too short, of another rate, or cannot be fitted.
    """
    settings = settings or CommissionSettings()
    rate = _one_rate(recordings)
    chirp = _of_role(recordings, "chirp")[0]
    plant = fit_plant(chirp, settings.band)
    healthy = _of_role(recordings, "healthy")
    plant = with_shift(plant, healthy, rate)
    references = [_reference(recording, plant, rate) for recording in healthy]
    velocity = VelocitySection(corner=settings.velocity_corner, sensor_corner=sensor_corner(chirp))
    around = (settings.before, settings.after)
    friction = friction_filter_of(_of_role(recordings, "friction"), plant, velocity, rate, around)
    return RigModel(
        sample_rate=rate,
        channels=CHANNELS,
        plant=plant,
        friction=FrictionSection(
            b=tuple(friction.function.b.tolist()),
            a=tuple(friction.function.a.tolist()),
            gamma=friction.gamma,
            explained=friction.explained,
        ),
        noise=_noise(healthy, plant, rate),
        velocity=velocity,
        window=WindowSection(length=settings.window, hop=settings.hop),
        decision=DecisionSection(settle=_settling(healthy[0], plant, rate)),
        reference=tuple(references),
        recording=tuple(
            RecordingSection(role=r.role, name=r.name, sha256=r.sha256) for r in recordings
        ),
    )


def _of_role(recordings: Sequence[Recording], role: Role) -> list[Recording]:
    found = [recording for recording in recordings if recording.role == role]
    if not found:
        raise ModelError(f"commissioning: found no {role} recording, expected at least one")
    return found


def _one_rate(recordings: Sequence[Recording]) -> float:
    rates = {recording.sample_rate for recording in recordings}
    if len(rates) != 1:
        raise ModelError(f"commissioning: found sample rates {sorted(rates)} Hz, expected one")
    return rates.pop()


def _reference(recording: Recording, plant: TransferPlant, rate: float) -> ReferenceSection:
    signals, period = steady_of(recording, plant, rate)
    found = averaged(signals, period)
    voltage, position, acceleration, modelled = (tuple(row.tolist()) for row in found.mean)
    return ReferenceSection(
        periods=found.periods,
        scale=scale_of(found.mean),
        voltage=voltage,
        position=position,
        acceleration=acceleration,
        modelled=modelled,
    )


def _noise(healthy: Sequence[Recording], plant: TransferPlant, rate: float) -> NoiseSection:
    """The largest scatter and probability of a repeated reading of any healthy recording."""
    scatters = []
    for recording in healthy:
        signals, period = steady_of(recording, plant, rate)
        scale = scale_of(averaged(signals, period).mean)
        residual = signals[2] - scale * signals[3]
        scatters.append(averaged(np.array([residual, signals[1], signals[0]]), period).scatter)
    residual_noise, position, voltage = np.max(scatters, axis=0)
    return NoiseSection(
        residual=float(residual_noise),
        position=float(position),
        voltage=float(voltage),
        repeat=tuple(max(chances) for chances in zip(*map(_repeats, healthy), strict=True)),
    )


def _repeats(healthy: Recording) -> list[float]:
    """Probability of a repeated reading of each channel, from raw readings after settling."""
    rate = healthy.sample_rate
    signals = np.array([healthy.channel(name) for name in CHANNELS])[:, round(START_S * rate) :]
    period = period_of(signals[0], longest=1024)
    whole = signals[:, : signals.shape[1] // period * period]
    mean = averaged(whole, period).mean
    return [chance_of_repeat(row, average) for row, average in zip(whole, mean, strict=True)]


def _settling(healthy: Recording, plant: TransferPlant, rate: float) -> int:
    """Samples until the modelled acceleration, started from rest at any phase, is steady."""
    signals, period = steady_of(healthy, plant, rate)
    found = averaged(signals, period)
    function, _ = modelled_acceleration(plant, rate)
    limit = 0.3 * averaged(signals[2:3], period).scatter[0]
    length = min(signals.shape[1] - period, round(8.0 * rate))
    latest = 0
    for start in range(0, period, max(period // 8, 1)):
        modelled = function.simulate(signals[0, start : start + length])
        steady = np.resize(np.roll(found.mean[3], -start), length)
        late = np.flatnonzero(np.abs(modelled - steady) > limit)
        latest = max(latest, int(late[-1]) + 1 if late.size else 0)
    return int(max(latest, round(0.5 * rate)))
