"""What a new study is proposed: which part decides, and where speeds are cut off.

All of it comes from the recordings alone, stands in the study's file, and may be changed there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.columns import Columns, bridged

QUIET = 0.02
"""Change over the range of a signal up to which nothing happens."""
WORTH_CUTTING = 0.05
"""Share of a recording without motion at an end from which it is left out."""
KEPT = 20
"""Samples at rest that stay before the motion, as they show the start."""
TOLD = 0.6
"""Share of a single recording that is fitted to; the rest decides."""
ENERGY, BEYOND = 0.999, 4.0
"""Share of a signal's energy below a frequency, and the low-pass over that frequency."""
BELOW_NYQUIST = 0.8
"""Low-pass over half the rate at most."""


@dataclass(frozen=True)
class Part:
    """A part of a recording.

    Attributes:
        recording: which one.
        start, end: [s]; `end` is infinite where it goes on to the recording's end.
    """

    recording: int
    start: float = 0.0
    end: float = float("inf")


def moving(table: Columns, names: Sequence[str]) -> tuple[float, float]:
    """Seconds between which something moves; long quiet ends of a recording show nothing."""
    signals = [bridged(table.values[name]) for name in names]
    restless = np.zeros(len(table), bool)
    for signal in signals:
        limit = QUIET * max(float(np.ptp(signal)), 1e-300)
        restless |= (np.abs(signal - signal[0]) > limit) & (np.abs(signal - signal[-1]) > limit)
    (at,) = np.nonzero(restless)
    if not len(at):
        return 0.0, float("inf")
    first, last, count = max(int(at[0]) - KEPT, 0), int(at[-1]) + KEPT, len(table)
    start = first * table.dt if first > WORTH_CUTTING * count else 0.0
    end = last * table.dt if count - last > WORTH_CUTTING * count else float("inf")
    return start, end


def proposed_split(
    tables: Sequence[Columns], names: Sequence[str]
) -> tuple[list[Part], list[Part]]:
    """Parts to fit to, and parts that decide.

    Of several recordings the one decides whose excitation goes least beyond the others'; a single
    one is cut in two, where it moves.

    Args:
        tables: the recordings.
        names: of the channels that drive the model.
    """
    parts = [Part(index, *moving(table, names)) for index, table in enumerate(tables)]
    if len(tables) > 1:
        decides = min(range(len(tables)), key=lambda index: (_beyond(tables, names, index), -index))
        return [p for p in parts if p.recording != decides], [parts[decides]]
    whole, last = parts[0], len(tables[0]) * tables[0].dt
    cut = round(whole.start + TOLD * (min(whole.end, last) - whole.start), 3)
    return [Part(0, whole.start, cut)], [Part(0, cut, whole.end)]


def _beyond(tables: Sequence[Columns], names: Sequence[str], index: int) -> float:
    """How far one recording's excitation goes beyond the others', over their range."""
    worst = 0.0
    for name in names:
        own = bridged(tables[index].values[name])
        rest = np.concatenate(
            [bridged(t.values[name]) for at, t in enumerate(tables) if at != index]
        )
        low, high = float(rest.min()), float(rest.max())
        over = max(float(own.max()) - high, low - float(own.min()), 0.0)
        worst = max(worst, over / max(high - low, 1e-300))
    return round(worst, 2)


def proposed_low_pass(tables: Sequence[Columns], name: str) -> float:
    """Corner of the low-pass before a channel is differentiated [Hz].

    Args:
        tables: the recordings.
        name: of the channel.
    """
    rate = 1 / max(table.dt for table in tables)
    tops = [_top(bridged(table.values[name]), 1 / table.dt) for table in tables]
    return float(f"{min(BEYOND * max(tops), BELOW_NYQUIST * rate / 2):.2g}")


def _top(signal: FloatArray, rate: float) -> float:
    """Frequency below which nearly all of a signal's energy is [Hz]."""
    frequencies, density = welch(signal, rate, nperseg=min(len(signal), 1024), detrend="linear")
    share = np.cumsum(density) / max(float(np.sum(density)), 1e-300)
    return float(frequencies[min(int(np.searchsorted(share, ENERGY)), len(frequencies) - 1)])
