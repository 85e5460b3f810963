"""What fitted equations leave of healthy recordings, and whether they describe the rig."""

from collections.abc import Sequence

import numpy as np

from monitor.commissioning.equations.described import TRAINED, Left, described, rms, with_pauses
from monitor.commissioning.equations.fitted_equations import admitted
from monitor.commissioning.unhealthy import check_healthy, white_noise
from monitor.model import (
    EquationsPlant,
    RemainderSection,
    SchemeSection,
)
from monitor.observer import (
    E,
    Layout,
    Observed,
    ObserverSignals,
    SpectralWidth,
    Spectrum,
    equations_of,
    fit_remainder,
    high_pass,
    layout_of,
    no_remainder,
)
from monitor.signals import Recording
from rigwatch.wire.arrays import FloatArray

SKIPPED = 1.0
"""Start of each recording that is skipped for the limits [s]."""
SLOW = 0.02
"""Share of the speed's rms indistinguishable from rest."""


def healthy_remainder(
    used: Sequence[Recording], plant: EquationsPlant, rate: float, jitters: Sequence[bool]
) -> tuple[list[Observed], list[str], RemainderSection, SchemeSection]:
    """What is kept of each recording, its role, and the remainder.

    Raises:
        ModelError: the residual is too large, or a recording is not healthy.
    """
    layout = layout_of(equations_of(plant), plant.port)
    size = ObserverSignals(plant, no_remainder(0), rate).remainder_size
    bare = _observed(used, plant, no_remainder(size), rate, jitters)
    filters, skip = high_pass(plant.corner, rate), round(SKIPPED * rate)
    pairs = [(o.arguments, o.judged[:, E]) for o in bare]
    del bare  # a recording's signals, of which six simulations, are a hundred columns
    earlier = [(z[: _split(z)], e[: _split(z)]) for z, e in pairs]
    later = _observed(
        used, plant, fit_remainder(earlier, filters, skip, layout.sensed), rate, jitters
    )
    steady = [
        (one.name, o.judged) for one, o in zip(used, later, strict=True) if one.role == "healthy"
    ]
    check_healthy([name for name, _ in steady], [judged for _, judged in steady], rate)
    slow = slow_speed(later, layout, plant)
    noise = min(white_noise(one.channel(layout.channels[-1])) for one in used)
    left = [
        Left(one.name, one.role, with_pauses(o), spectrum_of(o, layout, slow, rate).pace, noise)
        for one, o in zip(used, later, strict=True)
    ]
    del later
    found = described(left, plant.model, rate)
    scheme = SchemeSection(
        why="", held_out=found.held_out, share=found.share, described_hz=found.fastest
    )
    kept = [
        (z[begin:end], e[begin:end])
        for (z, e), (begin, end) in zip(pairs, found.parts, strict=True)
        if end > begin
    ]
    remainder = fit_remainder(kept, filters, skip, layout.sensed)
    every = _observed(used, plant, remainder, rate, jitters)
    cuts = [
        (o.part(begin, end), one.role)
        for one, o, (begin, end) in zip(used, every, found.parts, strict=True)
        if end > begin
    ]
    return [part for part, _ in cuts], [role for _, role in cuts], remainder, scheme


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
        found.append(signals.update(*admitted(one, signals.layout)))
    return found


def _split(rows: FloatArray) -> int:
    return round(TRAINED * len(rows))


def slow_speed(parts: Sequence[Observed], layout: Layout, plant: EquationsPlant) -> float:
    """Speed that cannot be distinguished from rest."""
    speeds = np.concatenate([o.rows[:, layout.speed] for o in parts])
    return max(SLOW * rms(speeds), plant.turn)


def spectrum_of(seen: Observed, layout: Layout, slow: float, rate: float) -> Spectrum:
    """Spectrum of a recording's motion."""
    speed = np.ascontiguousarray(seen.rows[:, layout.speed])
    return SpectralWidth(slow, rate).update(speed, seen.state)
