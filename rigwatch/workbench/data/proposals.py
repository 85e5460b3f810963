"""Proposals for a new study: the split into training and held-out parts, and the low-pass.

They are derived from the recordings, written to the study's file, and can be changed there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import welch

from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.workbench.data.columns import Columns, bridged

QUIET = 0.02
"""Change over the range of a signal up to which it counts as at rest."""
ANSWERED, NOISY = 0.05, 5.0
"""The same of an output, which a slow sensor's drift moves too, and over its median change from
sample to sample, about the standard deviation of white noise."""
MIN_REST_SHARE = 0.05
"""Smallest share of a recording at rest at an end for that end to be cut off."""
KEPT = 20
"""Samples at rest kept before the motion, as they show the initial state."""
TRAIN_SHARE = 0.6
"""Share of a single recording used for training; the rest is held out."""
LEAST_CHANGE = 0.05
"""Least share of the changes of what drives a model on either side of a split."""
ONE_IN = 4
"""Of so many recordings one is held out, rounded, and at least one: of six none decides alone."""
GOLDEN = 0.5 * (5**0.5 - 1)
"""Golden ratio: steps of this share of a series spread evenly over it, for any number of steps."""
ENERGY, BEYOND = 0.999, 4.0
"""Share of a signal's energy that defines its top frequency, and ratio of low-pass to that."""
BELOW_NYQUIST = 0.8
"""Largest ratio of low-pass to the Nyquist frequency."""


@dataclass(frozen=True)
class Part:
    """A part of a recording.

    Attributes:
        recording: index of the recording.
        start, end: [s]; `end` is infinite for the recording's end.
    """

    recording: int
    start: float = 0.0
    end: float = float("inf")


def moving(
    table: Columns, driving: Sequence[str], answers: Sequence[str] = ()
) -> tuple[float, float]:
    """Start and end of the motion [s]; long ends at rest carry no information.

    A machine that still answers the last change of what drives it is not at rest.

    Args:
        table: the recording.
        driving: names of the channels that drive the model.
        answers: those of its outputs, with noise.
    """
    restless = np.zeros(len(table), bool)
    for name in driving:
        signal = bridged(table.values[name])
        restless |= _away(signal, QUIET * float(np.ptp(signal)), signal[0], signal[-1])
    for name in answers:
        signal = bridged(table.values[name])
        noise = float(np.median(np.abs(np.diff(signal))))
        for length in (1, KEPT):  # fast answers, and slow ones in noise
            means = uniform_filter1d(signal, length, mode="nearest")
            limit = max(ANSWERED * float(np.ptp(means)), NOISY * noise / np.sqrt(length))
            restless |= _away(means, limit, np.median(means[:KEPT]), np.median(means[-KEPT:]))
    (at,) = np.nonzero(restless)
    if not len(at):
        return 0.0, float("inf")
    begin, stop, count = max(int(at[0]) - KEPT, 0), int(at[-1]) + KEPT, len(table)
    start = begin * table.dt if begin > MIN_REST_SHARE * count else 0.0
    end = stop * table.dt if count - stop > MIN_REST_SHARE * count else float("inf")
    return start, end


def _away(signal: FloatArray, limit: float, first: float, last: float) -> BoolArray:
    """Samples at which a signal is neither where it began nor where it ends."""
    least = max(limit, 1e-300)
    return np.asarray((np.abs(signal - first) > least) & (np.abs(signal - last) > least))


def proposed_split(
    tables: Sequence[Columns], names: Sequence[str], answers: Sequence[str] = ()
) -> tuple[list[Part], list[Part]]:
    """Training parts and held-out parts.

    Of several recordings, the one whose excitation exceeds the others' least is held out, and of
    six and more about a quarter of them; a single one is split into two within its motion.

    Args:
        tables: the recordings.
        names: of the channels that drive the model.
        answers: names of its outputs, which may move on when what drives it rests.
    """
    parts = [Part(index, *moving(table, names, answers)) for index, table in enumerate(tables)]
    if len(tables) > 1:
        decide = _deciding(tables, names)
        return [p for p in parts if p.recording not in decide], [parts[at] for at in decide]
    whole, last = parts[0], len(tables[0]) * tables[0].dt
    cut = round(_cut(tables[0], names, whole.start, min(whole.end, last)), 3)
    return [Part(0, whole.start, cut)], [Part(0, cut, whole.end)]


def _cut(table: Columns, names: Sequence[str], start: float, end: float) -> float:
    """Where to cut one recording [s], so that what drives it changes on both sides.

    If one side of the usual place holds hardly a change, it lies in the middle between two changes,
    about as many before it as usual.
    """
    usual = start + TRAIN_SHARE * (end - start)
    changes = _changes(table, names)
    first, last = round(start / table.dt), round(end / table.dt)
    total = max(float(changes[first:last].sum()), 1e-300)
    before = np.cumsum(changes[first:last]) / total
    enough = (before >= LEAST_CHANGE) & (before <= 1 - LEAST_CHANGE)
    both = np.flatnonzero(enough)
    if not len(both) or enough[min(round((usual - start) / table.dt), len(before) - 1)]:
        return usual
    distance = np.abs(before[both] - TRAIN_SHARE)
    nearest = both[distance <= distance.min() + LEAST_CHANGE]
    return start + float(np.median(nearest)) * table.dt


def unchanging(table: Columns, names: Sequence[str], part: Part) -> list[str]:
    """Channels that drive the model and never change within a part."""
    last = len(table) if part.end == float("inf") else round(part.end / table.dt)
    own = slice(round(part.start / table.dt), last)
    return [name for name in names if np.ptp(bridged(table.values[name])[own]) == 0]


def _changes(table: Columns, names: Sequence[str]) -> FloatArray:
    """Squared changes of channels from sample to sample, each over its range, shape (samples,)."""
    found = np.zeros(len(table))
    for name in names:
        signal = bridged(table.values[name])
        found[1:] += np.square(np.diff(signal) / max(float(np.ptp(signal)), 1e-300))
    return found


def _deciding(tables: Sequence[Columns], names: Sequence[str]) -> list[int]:
    """Recordings to hold out, about one in four: those whose excitation exceeds least.

    Of equals, logs of a series of settings, neighbours are alike: the choice is spread over them.
    """
    excess = [_excess(tables, names, index) for index in range(len(tables))]
    count = max((len(tables) + ONE_IN // 2) // ONE_IN, 1)
    limit = sorted(excess)[count - 1]
    certain = [index for index, own in enumerate(excess) if own < limit]
    equal = [index for index, own in enumerate(excess) if own == limit]
    spread = [
        equal[-1 - int(number * GOLDEN * len(equal)) % len(equal)]
        for number in range(count - len(certain))
    ]
    # Two numbers of a short series may fall on one recording.
    return sorted({*certain, *spread})


def _excess(tables: Sequence[Columns], names: Sequence[str], index: int) -> float:
    """How far one recording's excitation exceeds the others', relative to their range.

    Infinite if nothing changes in it: it decides nothing.
    """
    if names and len(unchanging(tables[index], names, Part(index))) == len(names):
        return float("inf")
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
    """Frequency below which nearly all of a signal's energy lies [Hz]."""
    frequencies, density = welch(signal, rate, nperseg=min(len(signal), 1024), detrend="linear")
    share = np.cumsum(density) / max(float(np.sum(density)), 1e-300)
    return float(frequencies[min(int(np.searchsorted(share, ENERGY)), len(frequencies) - 1)])
