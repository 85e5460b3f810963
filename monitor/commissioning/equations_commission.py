"""Commissioning of the observer: healthy recordings in, one model file out.

    chirp, healthy ─▶ motion ─▶ sensor behind the balance ─▶ parameters of the equations ─▶
    remainder ─▶ range of motion, healthy spread and limits

The equations are fitted to the first part of each recording; their residual on the rest decides
whether they describe the rig. No recording of a fault is needed.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np
from msgspec.structs import replace
from scipy.signal import savgol_coeffs

from monitor.commissioning.described import STARTED, TRAINED, Left, described, rms
from monitor.commissioning.healthy_fit import fit_healthy
from monitor.commissioning.healthy_limits import HealthyPart, healthy_limits
from monitor.commissioning.sensor_chain import fit_sensor
from monitor.commissioning.unhealthy import check_healthy, check_moves, white_noise
from monitor.commissioning.unseen_motion import largest_unseen
from monitor.model import (
    EquationsPlant,
    FrictionSection,
    NoiseSection,
    RangeSection,
    RecordingSection,
    RemainderSection,
    RigModel,
    SchemeSection,
)
from monitor.observer import (
    EMPTY,
    PREDICTED,
    E,
    LaggedSignals,
    Layout,
    Observed,
    ObserverSignals,
    SpectralWidth,
    Spectrum,
    base_model,
    bends_of,
    drive_energy,
    fit_remainder,
    force_port,
    high_pass,
    layout_of,
    levels,
    no_remainder,
    range_of,
    range_signals,
    remainder_signals,
)
from monitor.signals import GOOD, NEW_BOOT, Codes, Recording
from rigwatch.physics.engine.equations import measured_states
from rigwatch.physics.transfer import lateness
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

EQUATIONS = "servo-pneumatic"
"""Shipped model that is fitted by default."""
FITTED, CHIRP = 6.5, 14.5
"""Length of the fitted part of a recording, and of one with a frequency sweep [s]."""
SKIPPED = 1.0
"""Start of each recording that is skipped for the limits [s]."""
SLOW, TURNS = 0.02, 4.0
"""Share of the speed's rms, and multiple of its noise, indistinguishable from rest."""


def commission_equations(
    recordings: Sequence[Recording], name: str = EQUATIONS, corner: float = 2.0
) -> RigModel:
    """The model file of the observer scheme.

    Args:
        recordings: chirps and healthy ones; others are not used.
        name: of a shipped model, or its file.
        corner: of the high-pass of all judged signals [Hz].

    Raises:
        ModelError: there is no healthy recording, rates differ, a recording is short or at rest,
            the equations do not describe the rig, or a healthy recording is not healthy.
    """
    used = [one for one in recordings if one.role != "friction"]
    if not any(one.role == "healthy" for one in used):
        raise ModelError("commissioning: found no healthy recording, expected at least one")
    rates = {one.sample_rate for one in used}
    if len(rates) != 1:
        raise ModelError(f"commissioning: found sample rates {sorted(rates)} Hz, expected one")
    rate = rates.pop()
    check_moves(used, [state.channel for state in measured_states(base_model(name))])
    readings, seem = [False] * len(used), _seem_to_jitter(used, name, rate)
    if seem == readings:
        return _commissioned(used, name, corner, rate, readings)
    return _quieter(
        partial(_commissioned, used, name, corner, rate, jitters) for jitters in (readings, seem)
    )


def _seem_to_jitter(used: Sequence[Recording], name: str, rate: float) -> list[bool]:
    """Of which recordings the inputs' steps seem to jitter, which the motion must confirm."""
    layout = layout_of(base_model(name), force_port(base_model(name)))
    lag = _lag(name)
    seem = []
    for one in used:
        readings, in_force = (_motion(one, layout, lag, rate, 0.0, each) for each in (False, True))
        seem.append(not np.array_equal(readings, in_force))
    return seem


def _quieter(attempts: Iterable[Callable[[], RigModel]]) -> RigModel:
    """The model with the smaller healthy residual.

    Raises:
        ModelError: of the first attempt, if all fail.
    """
    made: list[RigModel] = []
    failed: list[ModelError] = []
    for attempt in attempts:
        try:
            made.append(attempt())
        except ModelError as error:
            failed.append(error)
    if not made:
        raise failed[0]
    return min(made, key=lambda model: model.noise.residual)


def _commissioned(
    used: Sequence[Recording], name: str, corner: float, rate: float, jitters: Sequence[bool]
) -> RigModel:
    """The model.

    Args:
        used: recordings.
        name: of the equations.
        corner: of the high-pass [Hz].
        rate: sample rate [Hz].
        jitters: of which recordings the inputs' steps jitter.

    Raises:
        ModelError: the equations do not describe the rig, or a recording is not healthy.
    """
    plant = _fitted(used, name, corner, rate, jitters)
    parts, roles, remainder, scheme = _remainder(used, plant, rate, jitters)
    return _model(used, plant, remainder, scheme, parts, roles, rate)


def _lag(name: str) -> int:
    return EquationsPlant(model=name, names=(), values=(), port="").half_width


def _fitted(
    used: Sequence[Recording], name: str, corner: float, rate: float, jitters: Sequence[bool]
) -> EquationsPlant:
    """The equations with parameters from the first part of each recording."""
    model = base_model(name)
    port = force_port(model)
    layout = layout_of(model, port)
    lag = _lag(name)
    late = _lateness(used, layout, rate)
    moved = [
        _motion(one, layout, lag, rate, late, each) for one, each in zip(used, jitters, strict=True)
    ]
    n = layout.inputs
    known = fit_sensor(model, [(m[:, :n], m[:, n], m[:, n + 1]) for m in moved], rate)
    stretches = [
        _cut(m, layout, round((CHIRP if one.role == "chirp" else FITTED) * rate))
        for one, m in zip(used, moved, strict=True)
    ]
    turn = TURNS * _speed_noise(used, layout, lag, rate)
    noise = min(white_noise(one.channel(layout.channels[-1])) for one in used)
    found = fit_healthy(
        name, port, stretches, turn=turn, corner=corner, rate=rate, noise=noise, known=known
    )
    return EquationsPlant(
        model=name, names=found.names, values=found.values, port=port, coulomb=found.coulomb,
        turn=turn, half_width=lag, late=late, corner=corner,
    )  # fmt: skip


def _lateness(used: Sequence[Recording], layout: Layout, rate: float) -> float:
    """Lateness of the motion behind the sensor of its rate [s], from the started recordings."""
    column, output = layout.balance, layout.channels[-1]
    begin = round(STARTED * rate)
    pairs = [
        (one.channel(layout.channels[column.channel])[begin:], one.channel(output)[begin:])
        for one in used
    ]
    return lateness(pairs, 1.0 / rate, column.order)


def _motion(  # noqa: PLR0917
    one: Recording, layout: Layout, lag: int, rate: float, late: float, jitters: bool
) -> FloatArray:
    signals = LaggedSignals(layout, lag, rate, late, jitters)
    columns, state, _ = signals.update(*_admitted(one, layout))
    return np.ascontiguousarray(columns[state != EMPTY])


def _admitted(one: Recording, layout: Layout) -> tuple[FloatArray, Codes]:
    signals = np.column_stack([one.channel(name) for name in layout.channels])
    code = np.full(len(signals), GOOD, np.int64)
    code[0] = NEW_BOOT
    return signals, code


def _cut(moved: FloatArray, layout: Layout, n: int) -> tuple[FloatArray, FloatArray]:
    inputs = layout.inputs
    return np.ascontiguousarray(moved[:n, :inputs]), np.ascontiguousarray(moved[:n, [inputs]])


def _speed_noise(used: Sequence[Recording], layout: Layout, lag: int, rate: float) -> float:
    column = layout.columns[layout.speed]
    channel = layout.channels[column.channel]
    kernel = savgol_coeffs(2 * lag + 1, 3, deriv=column.order, delta=1.0 / rate)
    noises = [white_noise(one.channel(channel)) for one in used]
    return max(min(noises) * float(np.linalg.norm(kernel)), 1e-9)


def _observed(
    used: Sequence[Recording],
    plant: EquationsPlant,
    remainder: RemainderSection,
    rate: float,
    jitters: Sequence[bool],
) -> list[Observed]:
    found = []
    for one, each in zip(used, jitters, strict=True):
        signals = ObserverSignals(plant, remainder, rate, each)
        found.append(signals.update(*_admitted(one, signals.layout)))
    return found


def _remainder(
    used: Sequence[Recording], plant: EquationsPlant, rate: float, jitters: Sequence[bool]
) -> tuple[list[Observed], list[str], RemainderSection, SchemeSection]:
    """What is kept of each recording, its role, and the remainder.

    Raises:
        ModelError: the residual is too large, or a recording is not healthy.
    """
    layout = layout_of(base_model(plant.model), plant.port)
    size = ObserverSignals(plant, no_remainder(0), rate).remainder_size
    bare = _observed(used, plant, no_remainder(size), rate, jitters)
    filters, skip = high_pass(plant.corner, rate), round(SKIPPED * rate)
    pairs = [(remainder_signals(o.rows, o.predicted.hidden, layout), o.judged[:, E]) for o in bare]
    earlier = [(z[: _split(z)], e[: _split(z)]) for z, e in pairs]
    later = _observed(used, plant, fit_remainder(earlier, filters, skip), rate, jitters)
    steady = [
        (one.name, o.judged) for one, o in zip(used, later, strict=True) if one.role == "healthy"
    ]
    check_healthy([name for name, _ in steady], [judged for _, judged in steady], rate)
    slow = _slow(later, layout, plant)
    left = [
        Left(one.name, one.role, o.judged, _spectrum(o, layout, slow, rate).pace)
        for one, o in zip(used, later, strict=True)
    ]
    found = described(left, plant.model, rate)
    scheme = SchemeSection(
        why="", held_out=found.held_out, share=found.share, described_hz=found.fastest
    )
    kept = [
        (z[begin:end], e[begin:end])
        for (z, e), (begin, end) in zip(pairs, found.parts, strict=True)
        if end > begin
    ]
    remainder = fit_remainder(kept, filters, skip)
    every = _observed(used, plant, remainder, rate, jitters)
    cuts = [
        (o.part(begin, end), one.role)
        for one, o, (begin, end) in zip(used, every, found.parts, strict=True)
        if end > begin
    ]
    return [part for part, _ in cuts], [role for _, role in cuts], remainder, scheme


def _split(rows: FloatArray) -> int:
    return round(TRAINED * len(rows))


def _slow(parts: Sequence[Observed], layout: Layout, plant: EquationsPlant) -> float:
    """Speed that cannot be distinguished from rest."""
    speeds = np.concatenate([o.rows[:, layout.speed] for o in parts])
    return max(SLOW * rms(speeds), plant.turn)


def _spectrum(seen: Observed, layout: Layout, slow: float, rate: float) -> Spectrum:
    """Spectrum of a recording's motion."""
    speed = np.ascontiguousarray(seen.rows[:, layout.speed])
    return SpectralWidth(slow, rate).update(speed, seen.state)


def _model(  # noqa: PLR0917 -- all that was found
    used: Sequence[Recording],
    plant: EquationsPlant,
    remainder: RemainderSection,
    scheme: SchemeSection,
    parts: Sequence[Observed],
    roles: Sequence[str],
    rate: float,
) -> RigModel:
    layout = layout_of(base_model(plant.model), plant.port)
    slow, begin = _slow(parts, layout, plant), round(STARTED * rate)
    signals = [range_signals(o)[o.state != EMPTY] for o in parts]
    spectra = [_spectrum(o, layout, slow, rate) for o in parts]
    motions = [Spectrum(*(figure[begin:] for figure in each)) for each in spectra]
    drives = [o.drive[begin:] for o in parts]
    bends = bends_of(used, base_model(plant.model))
    seen = range_of(layout.signals, signals, motions, drives, bends)
    healthy = [
        HealthyPart(
            o.judged,
            np.ascontiguousarray(o.rows[:, layout.speed]),
            levels(o.rows[:, list(layout.motions)], o.judged[:, PREDICTED], remainder),
            drive_energy(o.rows, seen, layout.motions),
            o.state,
            motion,
            drive,
        )
        for o, motion, drive in zip(parts, motions, drives, strict=True)
    ]
    skip = round(SKIPPED * rate)
    limits = healthy_limits(healthy, slow, skip, rate)
    model = RigModel(
        sample_rate=rate,
        channels=layout.channels,
        plant=plant,
        friction=FrictionSection(b=(1.0,), a=(1.0,), gamma=0.0),
        noise=NoiseSection(residual=limits.noise),
        remainder=remainder,
        motion_range=seen,
        healthy=limits,
        scheme=scheme,
        recording=tuple(
            RecordingSection(role=one.role, name=one.name, sha256=one.sha256) for one in used
        ),
    )

    def range_of_others(place: int) -> RangeSection:
        kept = [k for k in range(len(parts)) if k != place]
        return range_of(
            layout.signals, [signals[k] for k in kept], [motions[k] for k in kept],
            [drives[k] for k in kept], bends,
        )  # fmt: skip

    unseen = largest_unseen(model, parts, roles, range_of_others)
    return replace(model, healthy=replace(limits, unseen=unseen))
