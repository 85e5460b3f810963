"""Tables in rigwatch's own layout: one row a sample, in columns whose titles carry names and units.

    boot, seq, t_ns [ns], device_us [us], voltage [V], voltage quality, …

Only tables of samples have `device_us`. `export` writes them; reading one restores the same blocks.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rigwatch.wire.exchange.tables import Table
from rigwatch.wire.messages import Block, Column, EstimateBlock, SampleBlock, columns_of

BOOT, SEQ, T_NS, DEVICE_US = "boot", "seq", "t_ns [ns]", "device_us [us]"
QUALITY = " quality"
_TITLE = re.compile(r"^(?P<name>.*) \[(?P<unit>[^\[\]]*)\]$", re.DOTALL)
Array = np.ndarray[Any, Any]


def title(column: Column) -> str:
    """The column's title, with its unit."""
    return f"{column.name} [{column.unit}]"


def table_columns(block: Block) -> dict[str, Array]:
    """The block as columns of a table, by title; all of its length."""
    count = len(block)
    found: dict[str, Array] = {
        BOOT: np.full(count, block.boot, np.int64),
        SEQ: np.arange(block.seq, block.seq + count, dtype=np.int64),
        T_NS: block.t_ns,
    }
    if isinstance(block, SampleBlock):
        found[DEVICE_US] = block.device_us
    for column in columns_of(block):
        found[title(column)] = column.values
        if len(column.quality):
            found[column.name + QUALITY] = column.quality
    return found


def is_native(table: Table) -> bool:
    """Whether the table is in this layout."""
    return {BOOT, SEQ, T_NS} <= set(table.names)


def native_rate(table: Table) -> float:
    """The rate of a table in this layout by the median step of consecutive samples, 0 if none.

    Raises:
        ImportDataError: a cell is no whole number; file, line and column are named.
    """
    rows = [[part.integers(name) for name in (BOOT, SEQ, T_NS)] for part in table.parts()]
    boot, seq, t_ns = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    steps = np.diff(t_ns)[(np.diff(seq) == 1) & (np.diff(boot) == 0)]
    return float(f"{1e9 / float(np.median(steps)):.9g}") if len(steps) else 0.0


def native_blocks(table: Table, device: str) -> Iterator[SampleBlock | EstimateBlock]:
    """The blocks of a table in this layout: one for each run of consecutive samples of a part.

    Raises:
        ImportDataError: a cell is not what its column holds; file, line and column are named.
    """
    for part in table.parts():
        yield from _blocks_of(part, device)


def _blocks_of(table: Table, device: str) -> Iterator[SampleBlock | EstimateBlock]:
    boot, seq, t_ns = (table.integers(name) for name in (BOOT, SEQ, T_NS))
    columns = tuple(_columns(table))
    sampled = table.integers(DEVICE_US) if DEVICE_US in table.names else None
    breaks = np.flatnonzero((np.diff(seq) != 1) | (np.diff(boot) != 0)) + 1
    for a, b in zip([0, *breaks], [*breaks, len(seq)], strict=True):
        of, cut = (device, int(boot[a]), int(seq[a])), _cut(columns, slice(a, b))
        if sampled is None:
            yield EstimateBlock(*of, t_ns[a:b], cut)
        else:
            yield SampleBlock(*of, sampled[a:b], t_ns[a:b], cut)


def _columns(table: Table) -> list[Column]:
    found = []
    for name in table.names:
        match = _TITLE.match(name)
        if match is None or name in (T_NS, DEVICE_US):
            continue
        values = table.numbers(name, allow_missing=True)
        flags = match["name"] + QUALITY
        marks = (
            table.integers(flags).astype(np.uint8) if flags in table.names else np.zeros(0, "u1")
        )
        found.append(Column(match["name"], match["unit"], values, marks))
    return found


def _cut(columns: Sequence[Column], part: slice) -> tuple[Column, ...]:
    return tuple(
        Column(column.name, column.unit, column.values[part], column.quality[part])
        for column in columns
    )
