"""Refuses unsuitable healthy recordings: too short, at rest, or not healthy.

A recording is not healthy if friction sets in, or if it has more friction than the others. Dry
friction is estimated block by block,

    F = Σ g·e / Σ g²

with e the residual and g its response to 1 N. A step of F between two parts of a recording, or
between it and the others, is compared with the residual without friction. In healthy recordings of
simulated rigs the ratio is at most one tenth; where friction sets in it is at least six times as
large.
"""

from collections.abc import Sequence

import numpy as np

from monitor.observer import DRY_UNIT, MEDIUM, E
from monitor.signals import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

SECONDS, STARTED = 5.0, 2.0
"""Minimum length of a recording, and start of it whose spectrum is transient [s]."""
MOVES = 5.0
"""Minimum size of its motion in standard deviations of the noise."""
BLOCK, SETTLED = 128, 512
"""Samples per estimate, and samples skipped at the start."""
LEAST = 3
"""Minimum number of blocks on either side of a step, and of recordings to single one out."""
STEP = 2.5
"""Ratio of a friction step to the remaining residual above which a recording is refused."""


def least_samples(rate: float) -> int:
    """Samples from which limits can be taken, of a recording or of what is kept of it.

    They are the largest figures over windows of samples, of which a slow rate has few in a second.
    """
    return max(round(SECONDS * rate), round(STARTED * rate) + 2 * MEDIUM)


def check_moves(recordings: Sequence[Recording], shown: Sequence[str]) -> None:
    """Refuse recordings that are too short or without motion.

    Args:
        recordings: chirps and healthy ones.
        shown: channels that measure the motion.

    Raises:
        ModelError: a recording is short, or a channel contains only noise.
    """
    for one in recordings:
        samples, rate = len(one.channel(shown[0])), one.sample_rate
        if samples < least_samples(rate):
            raise ModelError(
                f"{one.name}: found {samples / rate:.1f} s of samples without a gap, expected at"
                f" least {least_samples(rate) / rate:g} s with the excitation running: record"
                " longer"
            )
        for name in shown:
            signal = one.channel(name)
            if np.std(signal) <= MOVES * white_noise(signal):
                raise ModelError(
                    f"{one.name}: found no motion in {name} beyond its noise, expected the"
                    " excitation to run: record with it, or check the channel"
                )


def white_noise(signal: FloatArray) -> float:
    """Root mean square of the white noise of a signal, from its third differences."""
    return max(float(np.std(np.diff(signal, 3)) / np.sqrt(20.0)), 1e-12)


def check_healthy(names: Sequence[str], judged: Sequence[FloatArray], rate: float) -> None:
    """Refuse healthy recordings with friction.

    Args:
        names: of the recordings.
        judged: judged columns of each, as in the decision, shape (n, 6).
        rate: sample rate [Hz].

    Raises:
        ModelError: friction sets in within a recording, or one recording has more than the others.
    """
    every = [(name, _blocks(one)) for name, one in zip(names, judged, strict=True)]
    # One that ends before a block is whole has no estimate, and tells nothing of the others.
    known = [(name, blocks) for name, blocks in every if blocks.size]
    for name, blocks in known:
        _check_onset(name, blocks, rate)
    if len(known) >= LEAST:
        for k, (name, blocks) in enumerate(known):
            _check_against_others(name, blocks, [b for _, b in known[:k] + known[k + 1 :]])


def _blocks(judged: FloatArray) -> FloatArray:
    """Friction [N], mean squares of its regressor and of the residual, shape (3, blocks)."""
    settled = judged[SETTLED:]
    whole = settled[: len(settled) // BLOCK * BLOCK].reshape(-1, BLOCK, judged.shape[1])
    g, e = whole[:, :, DRY_UNIT], whole[:, :, E]
    squares = np.maximum((g * g).mean(axis=1), 1e-12)
    return np.stack([(g * e).mean(axis=1) / squares, squares, (e * e).mean(axis=1)])


def _check_onset(name: str, blocks: FloatArray, rate: float) -> None:
    force, squares, errors = blocks
    places = range(LEAST, force.size - LEAST)
    if not places:
        return
    place = max(places, key=lambda at: _rise(force, at) * np.sqrt(at * (force.size - at)))
    step = _rise(force, place)
    found = step * np.sqrt(np.median(squares) / max(np.median(errors[:place]), 1e-300))
    if found > STEP:
        since = (SETTLED + place * BLOCK) / rate
        raise ModelError(
            f"{name}: found friction of about {step:.2g} N that sets in about {since:.0f} s after"
            " the beginning, expected a healthy recording: leave it out, or record again"
        )


def _rise(force: FloatArray, at: int) -> float:
    return float(force[at:].mean() - force[:at].mean())


def _check_against_others(name: str, blocks: FloatArray, others: Sequence[FloatArray]) -> None:
    force, squares, _ = blocks
    usual = float(np.median([np.median(other[0]) for other in others]))
    left = float(np.median([np.median(other[2]) for other in others]))
    more = float(np.median(force)) - usual
    if more * np.sqrt(np.median(squares) / max(left, 1e-300)) > STEP:
        raise ModelError(
            f"{name}: found about {more:.2g} N more friction than in the other healthy recordings,"
            " expected the same rig in the same state: leave it out, or record again"
        )
