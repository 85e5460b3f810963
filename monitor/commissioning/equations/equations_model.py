"""The model file of the observer: range of motion, healthy spread and limits."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from monitor.commissioning.equations.healthy_limits import HealthyPart, healthy_limits
from monitor.commissioning.equations.healthy_remainder import SKIPPED, slow_speed, spectrum_of
from monitor.commissioning.equations.unseen_motion import largest_unseen
from monitor.commissioning.unhealthy import STARTED
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
    Layout,
    Observed,
    Spectrum,
    bends_of,
    drive_energy,
    equations_of,
    layout_of,
    levels,
    range_of,
    range_signals,
)
from monitor.signals import Recording
from rigwatch.wire.arrays import FloatArray


def equations_model(  # noqa: PLR0917 -- all that was found
    used: Sequence[Recording],
    plant: EquationsPlant,
    remainder: RemainderSection,
    scheme: SchemeSection,
    parts: Sequence[Observed],
    roles: Sequence[str],
    rate: float,
) -> RigModel:
    """The model file, with limits at motions that were not recorded.

    Args:
        used: recordings.
        plant: fitted equations.
        remainder: of the healthy recordings.
        scheme: why, and how well, the equations describe the rig.
        parts: what is kept of each recording.
        roles: their roles.
        rate: sample rate [Hz].
    """
    model = equations_of(plant)
    layout = layout_of(model, plant.port)
    slow, skip = slow_speed(parts, layout, plant), round(SKIPPED * rate)
    motions = _motions_of(parts, layout, slow, rate, bends_of(used, model))
    every = range(len(parts))
    seen = motions.range_of(every)
    healthy = [
        _healthy_part(part, motions.each[at], layout, seen, remainder)
        for at, part in enumerate(parts)
    ]
    limits = healthy_limits(healthy, slow, skip, rate)
    found = RigModel(
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
    unseen = largest_unseen(
        found, parts, roles, lambda place: motions.range_of(at for at in every if at != place)
    )
    return replace(found, healthy=replace(limits, unseen=unseen))


@dataclass(frozen=True, eq=False)
class _Motion:
    """The motion of one recording.

    Attributes:
        signals: those whose range is kept, shape (n, signals).
        spectrum: of the motion after the start.
        drive: paces of the drive after the start.
        bands: energies of the drive after the start.
    """

    signals: FloatArray
    spectrum: Spectrum
    drive: FloatArray
    bands: FloatArray


@dataclass(frozen=True, eq=False)
class _Motions:
    """The motion of all recordings.

    Attributes:
        names: of the signals.
        each: the recordings.
        bends: largest differences of channels that measure a state.
    """

    names: Sequence[str]
    each: Sequence[_Motion]
    bends: Mapping[str, float]

    def range_of(self, places: Iterable[int]) -> RangeSection:
        """The range of motion of some recordings."""
        some = [self.each[place] for place in places]
        return range_of(
            self.names, [one.signals for one in some], [one.spectrum for one in some],
            [one.drive for one in some], self.bends,
        )  # fmt: skip


def _motions_of(
    parts: Sequence[Observed], layout: Layout, slow: float, rate: float, bends: Mapping[str, float]
) -> _Motions:
    begin, each = round(STARTED * rate), []
    for part in parts:
        spectrum = Spectrum(*(one[begin:] for one in spectrum_of(part, layout, slow, rate)))
        signals = range_signals(part)[part.state != EMPTY]
        each.append(_Motion(signals, spectrum, part.drive[begin:], part.bands[begin:]))
    return _Motions(layout.signals, each, bends)


def _healthy_part(
    part: Observed, motion: _Motion, layout: Layout, seen: RangeSection, remainder: RemainderSection
) -> HealthyPart:
    return HealthyPart(
        part.judged,
        np.ascontiguousarray(part.rows[:, layout.speed]),
        levels(part.rows[:, list(layout.motions)], part.judged[:, PREDICTED], remainder),
        drive_energy(part.rows, seen, layout.motions),
        part.state,
        motion.spectrum,
        motion.drive,
        motion.bands,
    )
