"""Up to which frequency of the motion equations describe a healthy rig.

Equations may lack what only matters in fast motion, such as a valve of limited rate. They then
leave a large part of the upper end of a sweep and little of slower recordings. The rig is judged
below that frequency; faster motion is as unknown as motion of a size that was not recorded.

Every recording tells how well its frequencies are described, by its power: what does not grow with
the motion, as hysteresis of a valve, is a large part of a weak sweep and little of a strong drive
at the same frequency. The sensor's own noise tells nothing of the equations, although it may be
half of what a weak sweep shows: its energy does not count, unless hardly anything else is measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.commissioning.unhealthy import STARTED, least_samples
from monitor.observer import FIRST, MEASURED, E, Observed
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

WORST = 0.2
"""Relative residual on held-out healthy data above which the equations are refused."""
DESCRIBED = 0.1
"""Relative residual of a band of frequencies up to which they describe it."""
SHOWS = 2.0
"""Energy of what is measured, relative to its sensor's noise, from which on it shows the motion."""
BAND = 1.2
"""Ratio of a band's ends."""
WINDOW = 1.0
"""Time over which residual and frequency are taken [s]."""
TRAINED = 2.0 / 3.0
"""Share of each recording used to fit the remainder; the rest judges it."""


@dataclass(frozen=True, eq=False)
class Left:
    """A healthy recording, the residual of which is that of a remainder fitted to its first part.

    Attributes:
        name, role: of the recording.
        judged: its judged columns, see `missing_force`, shape (n, columns).
        pace: mean frequency of its motion, shape (n,) [Hz].
        noise: of the sensor whose output is predicted, rms.
    """

    name: str
    role: str
    judged: FloatArray
    pace: FloatArray
    noise: float

    def share(self, begin: int, end: int) -> float:
        """Residual relative to what is measured, both beyond the noise; 0 of nothing."""
        part = self.judged[begin:end]
        if not len(part):
            return 0.0
        left, shown = self.beyond_noise(*np.mean(part[:, [E, MEASURED]] ** 2, axis=0).tolist())
        return float(np.sqrt(left / max(shown, 1e-24)))

    def beyond_noise(self, left: float, shown: float) -> tuple[float, float]:
        """Mean squares of the residual and of what is measured, without the noise in both."""
        noise = self.noise**2
        if shown < SHOWS * noise:
            return left, shown
        return max(left - noise, 0.0), shown - noise

    @property
    def held_out(self) -> int:
        """First sample that the remainder was not fitted to."""
        return round(TRAINED * self.pace.size)


@dataclass(frozen=True)
class Described:
    """What equations describe of healthy recordings.

    Attributes:
        parts: begin and end of what is kept of each [samples]; equal if nothing is.
        fastest: frequency above which the motion is not described [Hz]; 0 if there is none.
        share: largest relative residual on the held-out part of what is kept.
        held_out: root mean square of the residual on all of these.
    """

    parts: tuple[tuple[int, int], ...]
    fastest: float
    share: float
    held_out: float


def rms(signal: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(signal**2)))


def with_pauses(seen: Observed) -> FloatArray:
    """Judged columns of a recording, where all is left of what is measured while nothing is judged.

    After the equations have diverged they pause. Without a residual there, they would describe a
    recording the better the more often they diverge.
    """
    judged, paused = seen.judged.copy(), _paused(seen)
    if paused.any():
        shown = np.nan_to_num(seen.measured)
        shown -= shown[paused].mean() if paused.all() else shown[~paused].mean()
        judged[paused, MEASURED] = judged[paused, E] = shown[paused]
    return judged


def _paused(seen: Observed) -> BoolArray:
    """Samples from a divergence to where the equations begin anew, shape (n,)."""
    place = np.arange(len(seen.state))
    diverged, begun = (
        np.maximum.accumulate(np.where(at, place, -1))
        for at in (seen.predicted.reset, seen.state == FIRST)
    )
    return np.asarray(diverged > begun)


def described(recordings: Sequence[Left], model: str, rate: float) -> Described:
    """The part of healthy recordings that the equations describe.

    Args:
        recordings: chirps and healthy ones.
        model: name of the equations.
        rate: sample rate [Hz].

    Raises:
        ModelError: they describe no part that is worth watching.
    """
    shares = [one.share(one.held_out, one.pace.size) for one in recordings]
    bad = [one for one, share in zip(recordings, shares, strict=True) if not share <= WORST]
    fastest = _fastest(recordings, rate) if bad else 0.0
    parts = tuple(_slower(one, fastest, rate) if bad else (0, one.pace.size) for one in recordings)
    kept = [(one, part) for one, part in zip(recordings, parts, strict=True) if part[1]]
    left = max((_left_of(one, part, rate) for one, part in kept), default=np.inf)
    if not left <= WORST or not any(one.role == "healthy" for one, _ in kept):
        worst = int(np.argmax(np.nan_to_num(shares, nan=np.inf)))
        raise ModelError(
            f"{recordings[worst].name}: the equations of {model} leave {100 * shares[worst]:.0f} %"
            f" of a healthy recording, expected at most {100 * WORST:.0f} %: the model cannot judge"
            " this rig; try another model, or check that the recording is healthy"
        )
    errors = np.concatenate([one.judged[_held_out(one, part) : part[1], E] for one, part in kept])
    return Described(parts, fastest, left, rms(errors))


def _left_of(one: Left, part: tuple[int, int], rate: float) -> float:
    """Relative residual of what is kept: of its held-out samples or, without any, of all."""
    held_out = _held_out(one, part)
    begin = held_out if held_out < part[1] else max(part[0], round(STARTED * rate))
    return one.share(begin, part[1])


def _held_out(one: Left, part: tuple[int, int]) -> int:
    """First sample of what is kept of a recording that the remainder was not fitted to."""
    return max(one.held_out, part[0])


def _fastest(recordings: Sequence[Left], rate: float) -> float:
    """Upper end of the fastest band that is described [Hz]; 0 if there is none."""
    windows = _windows(recordings, rate)
    for top in np.sort(np.concatenate([one[0] for one in windows]))[::-1]:
        error = size = 0.0
        for one, (paces, errors, sizes) in zip(recordings, windows, strict=True):
            band = (paces <= top) & (paces >= top / BAND)
            if band.any():
                left, shown = one.beyond_noise(errors[band].mean(), sizes[band].mean())
                error, size = error + left, size + shown
        if error <= DESCRIBED**2 * size:
            return float(top)
    return 0.0


def _windows(recordings: Sequence[Left], rate: float) -> list[FloatArray]:
    """Pace, and mean squares of residual and of what is measured, over windows, (3, windows)."""
    length, found = round(WINDOW * rate), []
    for one in recordings:
        begin = round(STARTED * rate)
        columns = np.column_stack([one.pace, one.judged[:, [E, MEASURED]] ** 2])[begin:]
        whole = columns[: len(columns) // length * length]
        found.append(whole.reshape(-1, length, 3).mean(axis=1).T)
    return found


def _slower(one: Left, fastest: float, rate: float) -> tuple[int, int]:
    """The longest stretch of a recording whose motion is slow enough."""
    slow = one.pace <= fastest
    slow[: round(STARTED * rate)] = True
    ends = np.flatnonzero(np.diff(np.concatenate([[0], slow, [0]])))
    begin, end = max(zip(ends[::2], ends[1::2], strict=True), key=lambda run: run[1] - run[0])
    return (int(begin), int(end)) if end - begin >= least_samples(rate) else (0, 0)
