"""Blocks of one or many rigs judged by one call of a kernel, with the results of each by itself."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from monitor.model import RigModel
from monitor.pipeline.pipeline import PUBLISHED_ROWS
from monitor.pipeline.rig_monitor import Judged, RigMonitor
from monitor.pipeline.steady_kernel import judge_steady, new_outputs
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.messages import Column, SampleBlock

Finish = Callable[[], Judged]
"""Gives a rig's results once the kernel has judged its block; to be called before its next one."""


@dataclass(frozen=True, slots=True)
class Ready:
    """A block that can be judged together with others, from `ready_of`.

    Attributes:
        rig, block: whose block it is.
        state: of the rig's stages.
        rows: the places of the model's channels among the block's.
        alike: blocks for which it is the same are judged in one call.
    """

    rig: RigMonitor
    block: SampleBlock
    state: KeptState
    rows: list[int]
    alike: tuple[Any, ...]


def ready_of(rig: RigMonitor, block: SampleBlock) -> Ready | None:
    """The block, if it follows the last one (`RigMonitor.follows`) and has the model's channels."""
    state = rig.steady() if rig.follows(block) else None
    names = tuple([channel.name for channel in block.channels])
    rows = places_of(names, rig.model.channels)
    if state is None or rows is None:
        return None
    alike = state.kind, len(block), tuple([len(channel.quality) for channel in block.channels])
    return Ready(rig, block, state, rows, alike)


@lru_cache(maxsize=64)
def places_of(names: tuple[str, ...], wanted: tuple[str, ...]) -> list[int] | None:
    """The places of the wanted names among these; None if one is not there."""
    return [names.index(name) for name in wanted] if set(names).issuperset(wanted) else None


def judge_together(blocks: Sequence[Ready]) -> list[Finish | None]:
    """The results of `RigMonitor.judge` for a block of each of several rigs.

    None for one that turns out to have a gap or a reading that is not good: its rig is as before,
    and judges it alone. Conditions are left out where none holds and no alarm waits for one.
    """
    results: list[Finish | None] = [None] * len(blocks)
    groups: dict[tuple[Any, ...], list[int]] = {}
    for place, ready in enumerate(blocks):
        groups.setdefault(ready.alike, []).append(place)
    for places in groups.values():
        for place, finish in zip(places, _judged([blocks[at] for at in places]), strict=True):
            results[place] = finish
    return results


def _judged(alike: Sequence[Ready]) -> list[Finish | None]:
    blocks = [ready.block for ready in alike]
    r, n = len(blocks), len(blocks[0])
    columns = [column for block in blocks for column in block.channels]
    flags = np.concatenate([column.quality for column in columns])
    out = new_outputs(r, n, len(alike[0].rows))
    judge_steady(
        alike[0].state.state,
        np.array([ready.state.address for ready in alike]),
        np.concatenate([column.values for column in columns]).reshape(r, -1, n),
        flags.reshape(r, -1) if flags.size else np.zeros((r, 0), np.uint8),
        np.array([ready.rows for ready in alike]),
        np.concatenate([block.device_us for block in blocks]).reshape(r, n),
        np.array([block.seq for block in blocks]),
        out,
    )
    published = out.columns[:, PUBLISHED_ROWS]
    return [
        partial(ready.rig.completed, ready.block, published[at], out, at) if judged else None
        for at, (ready, judged) in enumerate(zip(alike, out.judged.tolist(), strict=True))
    ]


def judge_alone(rig: RigMonitor, block: SampleBlock) -> Judged | None:
    """`RigMonitor.judge`, by the kernel where the block simply follows: in half the time.

    Raises:
        KeyError: the block lacks a channel of the model.
    """
    ready = ready_of(rig, block)
    finish = None if ready is None else judge_together([ready])[0]
    return rig.judge(block) if finish is None else finish()


def compile_together(model: RigModel) -> None:
    """Run the kernel once on a separate monitor, so that no sample waits for the compiler."""
    rig, n = RigMonitor(model), 4
    zeros = np.zeros(n)
    channels = tuple(Column(name, "", zeros, np.zeros(n, np.uint8)) for name in model.channels)
    times = np.arange(2 * n, dtype=np.int64)
    rig.update(SampleBlock("", 0, 0, times[:n], times[:n], channels))
    state, rows = rig.steady(), [*range(len(channels))]
    if state is not None:
        block = SampleBlock("", 0, n, times[n:], times[n:], channels)
        _judged([Ready(rig, block, state, rows, ())])
