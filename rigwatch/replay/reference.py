"""References: everything that the monitor publishes over a recording, stored and read back.

A reference is a session file: blocks with every field, conditions included, and the alarms and
events. Values are stored to 24 bits, which halves the file; tolerances are far larger than that.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from monitor.alarms import Announcement
from monitor.pipeline import RigMonitor, Watched
from monitor.signals import Condition
from rigwatch.replay.run import judge
from rigwatch.replay.source import items
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import (
    Alarm,
    Column,
    EstimateBlock,
    Event,
    RunInfo,
    is_of_structure,
    merged,
    pieces,
)
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session import LARGEST_BLOCK, Session, SessionWriter, open_session

CONDITION = "condition"
_PARTS = ("active", "value", "low", "high")
_ENDLESS = 1 << 62


@dataclass(frozen=True)
class Output:
    """What the monitor published over a recording.

    Args:
        blocks: every field over each run of consecutive samples; the fields of a condition are
            called `condition.<name>.active`, `.value`, `.low` and `.high`.
        announcements: alarms and events, in order.
    """

    blocks: tuple[EstimateBlock, ...]
    announcements: tuple[Announcement, ...]

    @property
    def samples(self) -> int:
        """Number of samples judged."""
        return sum(map(len, self.blocks))


def output_of(session: Session, monitor: RigMonitor, size: int) -> Output:
    """What `monitor` publishes over `session`, in blocks of `size` samples.

    Raises:
        SessionError: samples lack a channel that the model needs.
    """
    parts: list[EstimateBlock] = []
    announcements: list[Announcement] = []
    for judged in judge(session, monitor, items(session, size=size)):
        if judged.watched is not None:
            parts.append(_with_conditions(judged.watched))
        announcements += judged.announced
    return Output(tuple(merged(parts, _ENDLESS)), tuple(announcements))


def _with_conditions(watched: Watched) -> EstimateBlock:
    at = watched.estimates
    conditions = [column for item in watched.conditions for column in _columns(item)]
    return EstimateBlock(at.device, at.boot, at.seq, at.t_ns, (*at.columns, *conditions))


def _columns(condition: Condition) -> list[Column]:
    return [
        Column(f"{CONDITION}.{condition.name}.{part}", "", _as_floats(getattr(condition, part)))
        for part in _PARTS
    ]


def _as_floats(values: "np.ndarray[tuple[int], np.dtype[np.generic]]") -> FloatArray:
    return np.asarray(values, np.float64)


def write_reference(path: Path, run: RunInfo, output: Output) -> None:
    """Write `output` as the reference at `path`, replacing an earlier one.

    Raises:
        SessionError: it cannot be written.
    """
    with new_file(path, replace=True) as part, SessionWriter(part, run, sync=False) as writer:
        for block in output.blocks:
            for piece in pieces(_rounded(block), LARGEST_BLOCK):
                writer.write(piece)
        for announcement in output.announcements:
            writer.write(announcement)


def _rounded(block: EstimateBlock) -> EstimateBlock:
    """The block with values rounded to 24 bits; larger ones stay as they are."""
    with np.errstate(over="ignore"):
        columns = tuple(
            Column(
                column.name,
                column.unit,
                np.where(
                    np.abs(column.values) < 1e38,
                    column.values.astype(np.float32).astype(np.float64),
                    column.values,
                ),
            )
            for column in block.columns
        )
    return EstimateBlock(block.device, block.boot, block.seq, block.t_ns, columns)


def read_reference(path: Path) -> Output:
    """The reference at `path`.

    Raises:
        SessionError: it cannot be read.
    """
    session = open_session(path)
    said = [item.message for item in session.messages(["alarms", "events"])]
    announcements = tuple(item for item in said if isinstance(item, Alarm | Event))
    found = (block for block in session.estimates(size=_ENDLESS) if not is_of_structure(block))
    return Output(tuple(found), announcements)
