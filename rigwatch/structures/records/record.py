"""A record: the sensor signals of a structure, sample by sample.

A file is CSV with a header, or NPZ; the column `t` [s] is the time, equally spaced from 0 on, and
the others are called after the signals they hold: x6, v6, a6 and the channels of recorded loads. An
empty cell, NaN or infinity is a sample that is missing. Where a load is, it is bridged, since the
model cannot run without it, and what the signals say there is missing too.
"""

import csv
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ImportDataError, ModelError, one_line
from rigwatch.wire.new_file import new_file

MOST_LOST = 0.2
"""Largest share of a load's samples that may be missing."""
LONGEST = 16
"""Samples in a row that may be missing of a load for a line to stand for them."""


@dataclass(frozen=True, eq=False)
class Record:
    """Columns sampled together, the first sample at t = 0.

    Attributes:
        dt: time between samples [s].
        columns: by name, each of shape (n,); NaN for invalid samples.
    """

    dt: float
    columns: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def recording(self, model: Model) -> Recording:
        """The columns that belong to the model; NaN for an output that was not recorded.

        Raises:
            ModelError: an input is missing, at all or in too many samples, or no output was
                recorded at all.
        """
        inputs = [self._input(i.channel or name, model.name) for name, i in model.inputs.items()]
        missing = np.full(len(self), np.nan)
        channels = {name: o.channel or name for name, o in model.outputs.items()}
        if not set(channels.values()) & set(self.columns):
            raise ModelError(
                f"{model.name}: found a record of {', '.join(self.columns)}, expected at least one"
                f" of {', '.join(channels.values())}"
            )
        outputs = [self.columns.get(channel, missing) for channel in channels.values()]
        driven = np.stack(inputs, axis=1) if inputs else np.zeros((len(self), 0))
        lost = np.asarray(~np.isfinite(driven).all(axis=1))
        shown = np.where(lost[:, None], np.nan, np.stack(outputs, axis=1))
        whole = [bridged(load) for load in driven.T]
        return Recording(self.dt, np.stack(whole, axis=1) if whole else driven, shown)

    def _input(self, channel: str, model: str) -> FloatArray:
        if channel not in self.columns:
            found = ", ".join(self.columns)
            raise ModelError(f"{model}: found a record of {found}, expected its load {channel!r}")
        column = self.columns[channel]
        share = float(np.mean(~np.isfinite(column)))
        if share > MOST_LOST:
            raise ModelError(
                f"{model}: found {share:.0%} of the load {channel!r} missing, expected at most"
                f" {MOST_LOST:.0%}"
            )
        return column


def bridged(load: FloatArray) -> FloatArray:
    """A load (samples,) without gaps: lines across short ones, its last value across longer ones.

    It is 0 as long as nothing is known of it.
    """
    rows, (known,) = np.arange(len(load)), np.nonzero(np.isfinite(load))
    if len(known) == len(load) or not len(known):
        return load if len(known) else np.zeros(len(load))
    at = np.searchsorted(known, rows, side="right") - 1
    before = np.where(at < 0, -1, known[at])
    after = np.append(known, len(load) + LONGEST)[at + 1]
    last = np.where(before < 0, 0.0, load[before])
    line = np.interp(rows, known, load[known])
    short = (after - before <= LONGEST + 1) | np.isfinite(load)
    return np.asarray(np.where(short, line, last))


def record_of(time: FloatArray, columns: Mapping[str, FloatArray], where: str = "record") -> Record:
    """A record of arrays.

    Raises:
        ImportDataError: the time is not equally spaced from 0 on, or a column has another shape.
    """
    for name, column in {"t": time, **columns}.items():
        if np.ndim(column) != 1:
            shape = " x ".join(map(str, np.shape(column))) or "a single number"
            raise ImportDataError(f"{where}: {name}: found {shape}, expected a single column")
    steps = np.diff(time)
    if len(time) < 2 or not np.all(np.isfinite(time)) or not steps.min() > 0:
        raise ImportDataError(f"{where}: t: found no rising time, expected at least two samples")
    dt = float(time[-1] - time[0]) / (len(time) - 1)
    if np.abs(steps - dt).max() > 1e-3 * dt or abs(time[0]) > 1e-6 * dt:
        span = f"{steps.min():g} to {steps.max():g} s from {time[0]:g} s on"
        raise ImportDataError(f"{where}: t: found steps of {span}, expected equal ones from 0 on")
    for name, column in columns.items():
        if len(column) != len(time):
            raise ImportDataError(
                f"{where}: {name}: found {len(column)} samples, expected {len(time)} as in t"
            )
    arrays = {name: np.asarray(column, np.float64) for name, column in columns.items()}
    return Record(dt, {name: np.where(np.isfinite(x), x, np.nan) for name, x in arrays.items()})


def read_record(path: Path | str) -> Record:
    """The record file at `path` (.csv or .npz).

    Raises:
        ImportDataError: it cannot be read, or its columns do not fit.
    """
    file = Path(path)
    try:
        table = _from_npz(file) if file.suffix == ".npz" else _from_csv(file)
    except (OSError, EOFError, ValueError, csv.Error, zipfile.BadZipFile) as error:
        why = one_line(error)
        raise ImportDataError(f"{file}: found {why}, expected columns of numbers") from error
    if "t" not in table:
        raise ImportDataError(f"{file}: found columns {', '.join(table)}, expected one called t")
    time = table.pop("t")
    if not table:
        raise ImportDataError(f"{file}: found no column but t, expected signals")
    return record_of(time, table, str(file))


def write_record(record: Record, path: Path | str) -> None:
    """Write a record as CSV or, for a path with that ending, NPZ; every digit is kept.

    Raises:
        ImportDataError: the file cannot be written.
    """
    file, time = Path(path), np.arange(len(record)) * record.dt
    with new_file(file, replace=True, raises=ImportDataError) as part:
        if file.suffix == ".npz":
            arrays: dict[str, Any] = {"t": time, **record.columns}
            with part.open("wb") as whole:
                np.savez_compressed(whole, **arrays)
            return
        with part.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            writer.writerow(["t", *record.columns])
            table = np.column_stack([time, *record.columns.values()])
            writer.writerows([[repr(cell) for cell in row] for row in table.tolist()])


def _from_npz(file: Path) -> dict[str, FloatArray]:
    with file.open("rb") as stream:
        archive = np.load(stream)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError("one array without a name")
        return {name: np.asarray(archive[name], np.float64) for name in archive.files}


def _from_csv(file: Path) -> dict[str, FloatArray]:
    with file.open(newline="", encoding="utf-8") as stream:
        rows = csv.reader(stream)
        header = [name.strip() for name in next(rows, [])]
        table = [[float(cell) if cell.strip() else np.nan for cell in row] for row in rows if row]
    if not header or any(len(row) != len(header) for row in table):
        raise ValueError("rows of another length than the header")
    values = np.array(table, np.float64).reshape(-1, len(header))
    return {name: values[:, index].copy() for index, name in enumerate(header)}
