"""Commissioning of the friction scheme: recordings in, one model file out.

chirp or multisine, no friction ──▶ Ĝ (5.16), (5.19); corner of the accelerometer
healthy reference(s)            ──▶ shift, amplitude scale, one healthy period, noise
known friction                  ──▶ friction filter Ge and γf (5.29)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.commissioning.friction_filter import FrictionFilter, fit_friction_filter
from monitor.commissioning.period import averaged, period_of
from monitor.commissioning.repeated_readings import chance_of_repeat
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
from rigwatch.physics.transfer import (
    FrequencyResponse,
    fit_transfer_function,
    frequency_response,
    velocity_filter,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

CHANNELS = ("voltage", "position", "acceleration")


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
    plant = _fit_plant(chirp, settings)
    healthy = _of_role(recordings, "healthy")
    plant = _with_shift(plant, healthy, rate)
    references = [_reference(recording, plant, rate) for recording in healthy]
    velocity = VelocitySection(corner=settings.velocity_corner, sensor_corner=_sensor_corner(chirp))
    friction = _friction(_of_role(recordings, "friction"), plant, velocity, rate, settings)
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


def _fit_plant(chirp: Recording, settings: CommissionSettings) -> TransferPlant:
    response = frequency_response(
        chirp.channel("voltage"), chirp.channel("position"), chirp.sample_rate
    )
    function = fit_transfer_function(response.band(*settings.band, least_coherence=0.5))
    return TransferPlant(b=tuple(function.b.tolist()), a=tuple(function.a.tolist()), shift=1)


def _sensor_corner(chirp: Recording) -> float:
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


def _with_shift(plant: TransferPlant, healthy: Sequence[Recording], rate: float) -> TransferPlant:
    """The model with the shift at which both accelerations agree best (docs/theory.md 1.2).

    Only advances up to Ĝ's own delay are tried: a longer one would delay every alarm, and the
    healthy average absorbs the remaining error.
    """
    leading = int(np.argmax(np.array(plant.b) != 0.0))
    candidates = [TransferPlant(b=plant.b, a=plant.a, shift=shift) for shift in range(leading + 1)]
    return max(candidates, key=lambda plant: sum(_correlation(plant, r, rate) for r in healthy))


def _correlation(plant: TransferPlant, healthy: Recording, rate: float) -> float:
    """Correlation of modelled and measured acceleration, without a recording's first quarter."""
    signals = _signals(healthy, plant, rate)[:, healthy.channel("voltage").size // 4 :]
    return float(np.corrcoef(signals[2], signals[3])[0, 1])


def _signals(recording: Recording, plant: TransferPlant, rate: float) -> FloatArray:
    """V, x, a, am, aligned, shape (4, n)."""
    function, delay = modelled_acceleration(plant, rate)
    voltage = recording.channel("voltage")
    late = [np.roll(recording.channel(name), delay) for name in CHANNELS[1:]]
    return np.array([voltage, *late, function.simulate(voltage)])


def _steady(recording: Recording, plant: TransferPlant, rate: float) -> tuple[FloatArray, int]:
    """Signals of the settled part, and the period."""
    signals = _signals(recording, plant, rate)[:, round(4.0 * rate) :]
    period = period_of(signals[0], longest=1024) if signals.shape[1] else 0
    if period == 0 or signals.shape[1] < 4 * period:
        raise ModelError(
            f"{recording.name}: found no period in the voltage, expected at least 4 s and four "
            "periods of an excitation that repeats after a whole number of samples"
        )
    return signals, period


def _scale(mean: FloatArray) -> float:
    return float(mean[2] @ mean[3] / (mean[3] @ mean[3]))


def _reference(recording: Recording, plant: TransferPlant, rate: float) -> ReferenceSection:
    signals, period = _steady(recording, plant, rate)
    found = averaged(signals, period)
    voltage, position, acceleration, modelled = (tuple(row.tolist()) for row in found.mean)
    return ReferenceSection(
        periods=found.periods,
        scale=_scale(found.mean),
        voltage=voltage,
        position=position,
        acceleration=acceleration,
        modelled=modelled,
    )


def _noise(healthy: Sequence[Recording], plant: TransferPlant, rate: float) -> NoiseSection:
    """The largest scatter and probability of a repeated reading of any healthy recording."""
    scatters = []
    for recording in healthy:
        signals, period = _steady(recording, plant, rate)
        scale = _scale(averaged(signals, period).mean)
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
    signals = np.array([healthy.channel(name) for name in CHANNELS])[:, round(4.0 * rate) :]
    period = period_of(signals[0], longest=1024)
    whole = signals[:, : signals.shape[1] // period * period]
    mean = averaged(whole, period).mean
    return [chance_of_repeat(row, average) for row, average in zip(whole, mean, strict=True)]


def _settling(healthy: Recording, plant: TransferPlant, rate: float) -> int:
    """Samples until the modelled acceleration, started from rest at any phase, is steady."""
    signals, period = _steady(healthy, plant, rate)
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


@dataclass(frozen=True, eq=False)
class _Onset:
    """Velocity (zero before the onset) and change of the residual around a known fault's onset."""

    velocity: FloatArray
    change: FloatArray


def _friction(
    recordings: Sequence[Recording],
    plant: TransferPlant,
    velocity: VelocitySection,
    rate: float,
    settings: CommissionSettings,
) -> FrictionFilter:
    """The friction filter: one per recording is fitted, and the best for all of them is used."""
    onsets = [_onset(recording, plant, velocity, rate, settings) for recording in recordings]
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
    settings: CommissionSettings,
) -> _Onset:
    signals, period = _steady(recording, plant, rate)
    function = velocity_filter(velocity.corner, rate, velocity.sensor_corner)
    speed = function.simulate(recording.channel("acceleration"))[round(4.0 * rate) :]
    change, begin = _change(recording, signals, period, rate)
    speed = np.where(np.arange(speed.size) >= begin, speed, 0.0)
    part = slice(max(begin - settings.before, 0), begin + settings.after)
    return _Onset(speed[part], change[part])


def _change(
    recording: Recording, signals: FloatArray, period: int, rate: float
) -> tuple[FloatArray, int]:
    """Change of the residual against the recording's own healthy start, and its onset [sample]."""
    beginning = max(4, round(rate / period)) * period
    found = averaged(signals[:, :beginning], period)
    scale = _scale(found.mean)
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
            f"{beginning / rate + 4.0:.1f} s, expected the fault to begin later"
        )
    return change, int(late[0])
