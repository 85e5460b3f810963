"""Foreign recordings as sessions: columns become channels in SI units on a uniform grid of time."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange.column_units import conversion
from rigwatch.wire.exchange.grid import Grid, fit_grid, mean_while_held, whole
from rigwatch.wire.exchange.mapping import ImportMapping, Source, parse_source
from rigwatch.wire.exchange.repeated_stamps import Stamps, increasing
from rigwatch.wire.exchange.session_columns import is_native, native_blocks, native_rate
from rigwatch.wire.exchange.table_files import read_table
from rigwatch.wire.exchange.tables import Table
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock, blocks
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session import LARGEST_BLOCK, SessionWriter, run_info


@dataclass(frozen=True, slots=True)
class Imported:
    """Result of an import.

    Attributes:
        path: the new session.
        samples: how many samples (or estimates) it has.
        rate_hz: their rate [Hz].
        channels: unit of each channel.
        remarks: changes to the data, in words; also in the session's notes.
    """

    path: Path
    samples: int
    rate_hz: float
    channels: dict[str, str]
    remarks: tuple[str, ...]


def import_file(source: Path, target: Path, mapping: ImportMapping, start_ns: int = 0) -> Imported:
    """A session at `target` of the CSV, MAT or Parquet file at `source`.

    A file written by `rigwatch export` is restored sample by sample if no channels are mapped.

    Args:
        source: the foreign file.
        target: the new session.
        mapping: which columns become which channels.
        start_ns: added to the file's times [ns].

    Raises:
        ImportDataError: the data do not fit the mapping; file, line and column are named.
        SessionError: the target exists or cannot be written.
    """
    table = read_table(source, mapping)
    if not mapping.channels and is_native(table):
        rate = mapping.rate or native_rate(table)
        found = native_blocks(table, mapping.device)
        return _write(found, target, mapping, rate, (f"imported from {source.name}",))
    if not mapping.channels:
        columns = ", ".join(table.names)
        raise ImportDataError(
            f"{source}: no channel is mapped, its columns are {columns};"
            " expected --map 'CHANNEL=COLUMN[UNIT]' or --mapping"
        )
    base, remarks = _time_base(table, mapping)
    remarks = (f"imported from {source.name}", *remarks)
    found = _sample_blocks(table, base, mapping, start_ns)
    return _write(found, target, mapping, base.grid.rate_hz, remarks)


@dataclass(frozen=True, slots=True)
class _TimeBase:
    """The uniform grid, and the rows that count with their own times [s]."""

    grid: Grid
    stamps: Stamps


def _time_base(table: Table, mapping: ImportMapping) -> tuple[_TimeBase, tuple[str, ...]]:
    """The times, and remarks on changes to them."""
    if not mapping.time:
        return _counted(table, mapping)
    source = _source("time", mapping.time, table, mapping)
    _check_filled("time", source, table)
    written = _in_si("time", source, table, structs.replace(mapping, flag_missing=False))
    columns = [_source(*each, table, mapping).column for each in mapping.channels.items()]
    stamps = increasing(table, source.column, written, columns)
    times = stamps.times
    grid = fit_grid(times, mapping.rate, mapping.max_hole)
    if not grid.jittered:
        return _TimeBase(grid, stamps), stamps.remarks
    shortest, longest = grid.steps_s
    holes = int(np.count_nonzero(grid.in_hole))
    span = f"{shortest * 1e3:.3g} to {longest * 1e3:.3g} ms"
    if shortest >= 1:
        span = f"{shortest:.3g} to {longest:.3g} s"
    by_means = mapping.held if grid.averages_held else ()
    held = f", {' and '.join(by_means)} by means over each step" if by_means else ""
    remark = (
        f"time stamps in steps of {span}: {len(times)} samples resampled to {len(grid.times)}"
        f" at {grid.rate_hz:g} Hz by linear interpolation{held}"
    )
    return _TimeBase(grid, stamps), (
        *stamps.remarks,
        remark,
        *([f"{holes} samples in holes are flagged stale"] * bool(holes)),
    )


def _source(channel: str, text: str, table: Table, mapping: ImportMapping) -> Source:
    """The source of a channel, its column and unit checked; errors name the file."""
    try:
        source = parse_source(channel, text, table.names)
        conversion(source.unit, channel, any_unit=mapping.any_unit)
    except ImportDataError as error:
        raise ImportDataError(f"{table.path}: {error}") from None
    if table.states_time(source.column) and source.unit != "s":
        raise ImportDataError(
            f"{table.path}: {channel}: found the unit {source.unit!r} for dates or durations, which"
            f" state their own: expected {source.column}[s]"
        )
    return source


def _counted(table: Table, mapping: ImportMapping) -> tuple[_TimeBase, tuple[str, ...]]:
    if mapping.rate is None:
        raise ImportDataError(
            f"{table.path}: found neither time nor rate, expected --time 'COLUMN[s]' or --rate HZ;"
            f" its columns are {', '.join(table.names)}"
        )
    channel, text = _counting(mapping)
    first = _source(channel, text, table, mapping)
    _check_filled(channel, first, table)
    count = len(table.cells[first.column])
    times = np.arange(count) / mapping.rate
    grid = whole(mapping.rate, times, (0.0, 0.0))
    return _TimeBase(grid, Stamps(times, np.ones(count, bool))), ()


def _check_filled(channel: str, source: Source, table: Table) -> None:
    """Raise if a column has no values: in JSON and MAT files columns differ in length."""
    if not len(table.cells[source.column]):
        raise ImportDataError(
            f"{table.path}: {channel}: found no values in {source.column!r}, expected at least one"
        )


def _in_si(channel: str, source: Source, table: Table, mapping: ImportMapping) -> FloatArray:
    to_si = conversion(source.unit, channel, any_unit=mapping.any_unit)
    values = table.numbers(source.column, mapping.flag_missing)
    factor = source.factor
    if isinstance(factor, str):
        if factor not in table.scalars:
            known = ", ".join(table.scalars) or "none"
            raise ImportDataError(
                f"{table.path}: {channel}: found no scalar {factor!r}, expected one of {known}"
            )
        factor = table.scalars[factor]
    if (factor, source.offset, to_si.factor, to_si.offset) == (1.0, 0.0, 1.0, 0.0):
        return values
    with np.errstate(over="ignore", invalid="ignore"):  # too large: flagged as not finite
        return (factor * values + source.offset) * to_si.factor + to_si.offset


def _sample_blocks(
    table: Table, base: _TimeBase, mapping: ImportMapping, start_ns: int
) -> Iterator[SampleBlock]:
    """The samples in the table's parts; those of a jittered recording, interpolated, in one."""
    counted = _source(*_counting(mapping), table, mapping).column
    row = first = 0
    for part in [table] if base.grid.jittered else table.parts():
        kept = base.stamps.kept[row : row + len(part.cells[counted])]
        row += len(kept)
        if kept.any():
            columns = tuple(
                _channel(name, text, part, kept, mapping) for name, text in mapping.channels.items()
            )
            if base.grid.jittered:
                columns = tuple(
                    _resampled(c, base.grid, base.stamps.times, held=c.name in mapping.held)
                    for c in columns
                )
            yield _block(mapping.device, columns, base.grid, first, start_ns)
            first += len(columns[0].values)


def _counting(mapping: ImportMapping) -> tuple[str, str]:
    """The column whose length counts, as channel and source."""
    return ("time", mapping.time) if mapping.time else next(iter(mapping.channels.items()))


def _channel(
    name: str,
    text: str,
    table: Table,
    kept: NDArray[np.bool_],
    mapping: ImportMapping,
) -> Column:
    source = _source(name, text, table, mapping)
    unit = conversion(source.unit, name, any_unit=mapping.any_unit).unit
    values = _in_si(name, source, table, mapping)
    if len(values) != len(kept):
        found = f"found {len(values)} values, expected {len(kept)} as there are times"
        raise ImportDataError(f"{table.path}: {name}: {found}")
    values = values[kept]
    flags = np.where(np.isfinite(values), quality.GOOD, quality.NON_FINITE).astype(np.uint8)
    return Column(name, unit, values, flags)


def _resampled(column: Column, grid: Grid, times: FloatArray, *, held: bool) -> Column:
    """Interpolated between finite neighbours; points next to a missing sample are invalid.

    Args:
        column: one value for each time.
        grid: of the result.
        times: shape (n,) [s].
        held: whether each value acts until the next row: the mean until the next point of the grid
            is taken then, since a line between two commands is a command that nobody gave.
    """
    missing = column.quality != quality.GOOD
    if missing.all():
        found = np.full(len(grid.times), np.nan)
    elif held and grid.averages_held:
        found = mean_while_held(grid, times[~missing], column.values[~missing])
    else:
        found = np.interp(grid.times, times[~missing], column.values[~missing])
    near_missing = np.interp(grid.times, times, missing.astype(np.float64)) > 0
    marks = np.where(grid.own, quality.GOOD, quality.RESAMPLED).astype(np.uint8)
    marks[near_missing] |= quality.NON_FINITE
    marks[grid.in_hole] |= quality.STALE
    return Column(column.name, column.unit, found, marks)


def _block(
    device: str, columns: tuple[Column, ...], grid: Grid, first: int, start_ns: int
) -> SampleBlock:
    """The samples from number `first` of the grid on."""
    times = grid.times[first : first + len(columns[0].values)]
    since_start = np.round((times - grid.times[0]) * 1e9).astype(np.int64)
    first_ns = start_ns + round(float(grid.times[0]) * 1e9)
    if first_ns < 0:
        first_ns = start_ns
    return SampleBlock(device, 1, first, since_start // 1000, first_ns + since_start, columns)


def _write(
    found: Iterator[SampleBlock | EstimateBlock],
    target: Path,
    mapping: ImportMapping,
    rate: float,
    remarks: tuple[str, ...],
) -> Imported:
    notes = "; ".join(filter(None, (*remarks, mapping.notes)))
    first = next(found)
    run = run_info(mapping.rig, rate, t_ns=int(first.t_ns[0]), notes=notes)
    samples = 0
    with new_file(target) as part, SessionWriter(part, run, sync=False) as writer:
        for block in chain([first], found):
            samples += len(block)
            for piece in blocks.pieces(block, LARGEST_BLOCK):  # type: ignore[type-var]
                writer.write(piece)
    units = {column.name: column.unit for column in blocks.columns_of(first)}
    return Imported(target, samples, rate, units, remarks)
