"""Where a model fails whose fit did not converge, and on what its recordings disagree.

No effect is ranked beside such a model. What it leaves still shows where it is wrong: in parts of a
channel that hold more of it than others, and in parameters of which each recording by itself asks
another value.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, Region, locate, recording_name
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import (
    TrainingPart,
    Value,
    as_written,
    each_recording,
    shown,
    trained,
    values,
)
from rigwatch.workbench.study import FILE, told, told_unit

STANDS_OUT = 1.5
"""Share of the energy over that of the samples from which a part of a recording stands out."""
NARROW = 0.25
"""Share of the energy from which a band of frequencies stands out."""
MOST_PARAMETERS = 3
"""Parameters on which recordings disagree that are told."""
FEW_RECORDINGS = 8
"""Number of recordings up to which each is fitted by itself."""
NEXT = (
    "`rigwatch locate {study}` shows all of it, and `rigwatch add {study} EFFECT --port PORT` tries"
    " what may act there; values that you know go under [start] in {study}/{file}, and"
    " `fixed = true` in the model holds them"
)


def with_failure_told(bench: Bench, found: Verdict) -> Verdict:
    """The verdict on a fit that did not converge, with where the model fails and what to do.

    Args:
        bench: the study with that fit.
        found: the verdict.
    """
    parts = [found.text, _where(bench), *_disagreed(bench)]
    parts.append(NEXT.format(study=bench.study.folder, file=FILE))
    return replace(found, text="; ".join(parts))


def _where(bench: Bench) -> str:
    """The channel with most of the error, and the parts that stand out in it, in words."""
    ratios = bench.base.train.rms / bench.floor.rms
    worst = int(np.argmax(ratios))
    channel, output = list(bench.study.model.outputs.items())[worst]
    unit = told_unit(output)
    rms = told(float(bench.base.train.rms[worst]), unit)
    text = f"most is left of {channel}: {rms:.3g} {unit}, {ratios[worst]:.3g} times its noise"
    regions = [region for region in locate(bench) if region.channel == channel]
    return ", ".join([text, *_standing_out(bench, regions)])


def _standing_out(bench: Bench, regions: Sequence[Region]) -> Iterator[str]:
    """The part with most above its share of the samples: by motion or input, then by time."""
    samples = bench.base.train.residuals[..., 0].size
    placed = [region for region in regions if len(region.samples)]
    for by_time in (False, True):
        over = {
            region: region.share * samples / len(region.samples)
            for region in placed
            if (region.view == "time") is by_time
        }
        most = max(over, key=lambda region: over[region], default=None)
        if most is not None and over[most] >= STANDS_OUT:
            yield f"{most.share:.0%} of it {_place_of(bench, most)}"
    bands = [region for region in regions if region.view == "frequency"]
    widest = max(bands, key=lambda region: region.share, default=None)
    if widest is not None and widest.share >= NARROW:
        yield f"{widest.share:.0%} of it from {widest.name}"


def _place_of(bench: Bench, region: Region) -> str:
    """The time, the part of the motion, or the size of an input, in words."""
    if region.view == "time":
        several = len(bench.data.train.slices) > 1
        return f"in {region.name}" if several else f"from {region.name}"
    return region.name if region.view == "direction" else f"at {region.name}"


def _disagreed(bench: Bench) -> Iterator[str]:
    """The parameters of which recordings by themselves ask for values far apart, in words."""
    parts = each_recording(bench.study, bench.data)
    if not 2 <= len(parts) <= FEW_RECORDINGS:
        return
    alone = [_alone(bench, part) for part in parts]
    found = [_furthest(bench, alone, name) for name in bench.base.compiled.system.free]
    apart = sorted((one for one in found if one[0] > 1.0), reverse=True)[:MOST_PARAMETERS]
    if apart:
        told_apart = ", ".join(text for _, text in apart)
        yield f"fitted by themselves, the recordings disagree: {told_apart}"


def _alone(bench: Bench, part: TrainingPart) -> dict[str, Value]:
    """The parameters of the model fitted to one recording; none if it cannot be fitted."""
    base = part.of(bench.base)
    try:
        fitted = trained(bench.study, part.data, base.placements, base.train.values(), base)
    except ModelError:
        return {}
    return as_written(values(fitted.train), fitted.compiled.system)


def _furthest(bench: Bench, alone: Sequence[dict[str, Value]], name: str) -> tuple[float, str]:
    """How far apart two recordings' values are, over both half widths, and the values in words."""
    known = [(at, own[name]) for at, own in enumerate(alone) if name in own]
    far = [(_apart(one, other), i, k) for (i, one), (k, other) in combinations(known, 2)]
    if not far:
        return 0.0, ""
    distance, *pair = max(far)
    ends = " and ".join(f"{shown(alone[at][name])} in {recording_name(bench, at)}" for at in pair)
    return distance, f"{name} is {ends}"


def _apart(one: Value, other: Value) -> float:
    """Distance of two values over the sum of their intervals' half widths."""
    if one.interval is None or other.interval is None:
        return 0.0
    half = sum((high - low) / 2 for low, high in (one.interval, other.interval))
    return abs(one.value - other.value) / max(half, 1e-300)
