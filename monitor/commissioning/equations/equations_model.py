"""The model file of the observer: range of motion, healthy spread and limits."""

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from monitor.commissioning.equations.described import STARTED
from monitor.commissioning.equations.healthy_limits import HealthyPart, healthy_limits
from monitor.commissioning.equations.healthy_remainder import SKIPPED, slow_speed, spectrum_of
from monitor.commissioning.equations.unseen_motion import largest_unseen
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
    Observed,
    Spectrum,
    base_model,
    bends_of,
    drive_energy,
    layout_of,
    levels,
    range_of,
    range_signals,
)
from monitor.signals import Recording


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
    layout = layout_of(base_model(plant.model), plant.port)
    slow, begin = slow_speed(parts, layout, plant), round(STARTED * rate)
    signals = [range_signals(o)[o.state != EMPTY] for o in parts]
    spectra = [spectrum_of(o, layout, slow, rate) for o in parts]
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
            o.bands[begin:],
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
