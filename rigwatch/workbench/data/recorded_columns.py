"""Columns of a recorded session, and signals derived from them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rigwatch.physics.transfer import Derivative
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.session import open_session
from rigwatch.workbench.data.columns import Columns, bridged
from rigwatch.workbench.data.signal_units import in_si
from rigwatch.workbench.study import Derive, Span

MOST_LOST = 0.5
"""Share of samples up to which interpolated ones stand for lost rows; beyond, all are moved."""
INTERPOLATED = "samples are interpolated, as their times are uneven"
"""How a recording is altered that an import has put on a uniform grid."""
MEAN_AT = 0.25
"""Highest frequency over the rate at which interpolated samples show their noise. Each mixes two
neighbours, so that the density of white noise becomes r0 + 2 r1 cos(2 pi f): its mean, r0, stands
at a quarter of the rate, more below, less above."""
SET_NS, MOST_DRIFT = 5e8, 1e-3
"""What a clock is set by at least [ns], and how fast or slow it may run over a gap."""
PADDED = 15
"""Samples by which a recording is continued at both ends before it is low-passed twice."""
LARGEST = 1e70
"""Largest value that counts as measured [SI]: the fourth power is summed over a recording."""


def read_columns(folder: Path, span: Span) -> Columns:
    """The channels of a session, or of a part of it.

    Raises:
        SessionError: it cannot be read.
        ModelError: it holds no samples there.
    """
    blocks = list(open_session(folder / span.session).samples())
    boots = {(b.device, b.boot) for b in blocks}
    if not blocks or len(boots) > 1:
        raise ModelError(f"{span.session}: found {len(boots)} runs of a device, expected one")
    first, last = blocks[0], blocks[-1]
    count = last.seq + len(last) - first.seq
    dt = _elapsed_ns(blocks) * 1e-9 / max(count - 1, 1)
    if not dt > 0:
        raise ModelError(
            f"{span.session}: found {count} samples in {dt * (count - 1):g} s, expected at least"
            " two, one after the other"
        )
    values = {c.name: np.full(count, np.nan) for c in first.channels}
    moved = _share_interpolated(blocks) > MOST_LOST
    for block in blocks:
        at = block.seq - first.seq
        for column in block.channels:
            into = values.setdefault(column.name, np.full(count, np.nan))
            into[at : at + len(block)] = column.usable() if moved else _measured(column)
    begin, end = round(span.start / dt), min(count, round(min(span.end, 1e9) / dt))
    if end - begin < 2:
        raise ModelError(
            f"{span.session}: found {count * dt:g} s, expected samples from {span.start:g} s"
            f" to {span.end:g} s"
        )
    units = {column.name: column.unit for block in blocks for column in block.channels}
    cut = {name: in_si(column[begin:end], units[name]) for name, column in values.items()}
    measured = {name: _measurable(column) for name, column in cut.items()}
    if moved:
        return Columns(dt, measured, units, (INTERPOLATED,), MEAN_AT)
    return Columns(dt, measured, units)


def _elapsed_ns(blocks: Sequence[SampleBlock]) -> float:
    """Time from the first sample to the last [ns], whatever the clock was set by in between."""
    t_ns = np.concatenate([block.t_ns for block in blocks])
    numbers = np.diff(np.concatenate([block.seq + np.arange(len(block)) for block in blocks]))
    steps = np.diff(t_ns)
    if not len(steps):
        return 0.0
    usual = float(np.median(steps / numbers))
    odd = steps - usual * numbers
    was_set = np.abs(odd) > SET_NS + usual * (2.0 + MOST_DRIFT * numbers)
    return float(t_ns[-1] - t_ns[0]) - float(np.sum(odd[was_set]))


def _share_interpolated(blocks: Sequence[SampleBlock]) -> float:
    """Share of the values that an import has interpolated."""
    marks = np.concatenate([c.quality for block in blocks for c in block.channels])
    return float(np.mean((marks & quality.RESAMPLED) != 0))


def _measured(column: Column) -> FloatArray:
    """The values; NaN where they are invalid, or interpolated where rows are lost."""
    return np.where(column.quality & quality.RESAMPLED, np.nan, column.usable())


def _measurable(column: FloatArray) -> FloatArray:
    """The column without values that no sensor gives and no sum can hold."""
    return np.where(np.abs(column) < LARGEST, column, np.nan)


def with_derived(columns: Columns, derive: Derive | None) -> Columns:
    """The channels and the signals derived from them.

    Raises:
        ModelError: a channel is missing, or the low-pass is above half the sample rate.
    """
    if derive is None:
        return columns
    rate = 1 / columns.dt
    if derive.low_pass >= rate / 2:
        raise ModelError(
            f"derive: found low_pass {derive.low_pass:g} Hz, expected less than half of {rate:g} Hz"
        )
    if len(columns) <= PADDED:
        raise ModelError(
            f"derive: found a recording of {len(columns)} samples, expected at least {PADDED + 1}"
            " for its low-pass"
        )
    found, derived = dict(columns.values), dict(columns.derived)
    for name, signal in derive.signals.items():
        if signal.channel not in columns.values:
            raise ModelError(
                f"derive: found channel {signal.channel!r}{nearest(signal.channel, columns.values)}"
            )
        raw = columns.values[signal.channel]
        derived[name] = Derivative(derive.low_pass, signal.order, rate)
        found[name] = np.where(np.isfinite(raw), derived[name].of(bridged(raw)), np.nan)
    units = {**columns.units, **_derived_units(columns, derive)}
    return replace(columns, values=found, units=units, derived=derived)


def _derived_units(columns: Columns, derive: Derive) -> dict[str, str]:
    units = {name: columns.units.get(s.channel, "") for name, s in derive.signals.items()}
    return {
        name: f"({unit})/s^{derive.signals[name].order}" if unit else ""
        for name, unit in units.items()
    }
