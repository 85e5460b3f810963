"""Thins a session: of its samples and estimates stay the figures per second.

The index has those of the estimates already; those of the samples are stored beside them, as names
`samples.<channel>`. Values with a quality flag do not count.
"""

import numpy as np

from rigwatch.archive.catalogue import Catalogue, Row, save
from rigwatch.archive.entry import THINNED, Entry, stored_seconds
from rigwatch.archive.second_aggregates import SecondAggregates
from rigwatch.archive.store import Store, Stored
from rigwatch.recorder import POSITIONS
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock, valid
from rigwatch.wire.session import SUFFIX, open_session

REMARK = "its recording is removed, its figures per second are kept"


def thin(store: Store, entry: Entry, row: Row) -> None:
    """Store the figures per second of a session's samples; its row says that it is thinned.

    Raises:
        ArchiveError: the store cannot be read or written.
        SessionError: the session cannot be read.
    """
    if row["status"] == THINNED:
        return
    seconds = SecondAggregates()
    with store.local([file.name for file in entry.files]) as paths:
        for block in open_session(paths[0] if len(paths) == 1 else paths[0].parent).samples():
            seconds.add(_as_figures(block))
    names = stored_seconds(store, seconds, row["rig"], f"{row['content'][:16]}-samples")
    row |= {"files": [*(row["files"] or ()), *names], "status": THINNED, "remark": REMARK}
    row["going"] = [str(file) for file in entry.files]


def finish_thinning(store: Store, kept: Catalogue, files: list[Stored]) -> int:
    """Remove what a thinning that was stopped has left of its recordings.

    Args:
        store: the archive.
        kept: its catalogue, which holds all that stays of them.
        files: those of the archive.

    Returns:
        Number of recordings whose removal is finished.
    """
    rows = [row for row in kept.sessions.values() if row.get("going")]
    for row in rows:
        going = set(row["going"])
        names = [file.name for file in files if str(file) in going]
        if not row["session"].endswith(SUFFIX):
            names += [f"{row['session']}/{name}" for name in POSITIONS]
        for name in names:
            store.remove(name)
        row["going"] = None
    if rows:
        save(store, kept)
    return len(rows)


def _as_figures(block: SampleBlock) -> EstimateBlock:
    """The channels as columns, with NaN for values that do not count."""
    columns = [
        Column(f"samples.{one.name}", one.unit, np.where(valid(one.quality), one.values, np.nan))
        if len(one.quality)
        else Column(f"samples.{one.name}", one.unit, one.values)
        for one in block.channels
    ]
    return EstimateBlock(block.device, block.boot, block.seq, block.t_ns, tuple(columns))
