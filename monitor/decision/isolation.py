"""Isolation: is the change dry friction, or one of its rivals?

The change of the residual since its onset is fitted by two hypotheses over the same samples:

    friction   y = θ1·Ge[sgn v] + θ2·Ge[v]                                                 (5.33)
    rivals     any change that is smooth in the healthy motion (gain, lag, delay, lost pressure,
               spring, mass, damping, bias, and their nonlinearities), spanned by A, dA, X, dX, 1,
               the first two also growing in time, and the products X², X·dX, X³, X²·dX, with A and
               X one healthy period of acceleration and position and d the difference of neighbours

Other faults are smooth in the healthy motion or nearly so. Dry friction jumps when the velocity
changes sign. The test therefore measures what the jump explains beyond the rivals,

    share = (part of y that Ge[sgn v] explains beyond the rivals)² / y²,
    ρ     = the same, relative to the residual of the rivals,

with the sign that dissipates energy (θ1 > 0). A mass at rest while the healthy one moves, in both
position and acceleration, is stiction; no smooth fault does that.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.reference import Reference, place_in_period
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

HISTORY = 512
"""Number of samples stored for isolation."""
Y, SIGN_PART, SPEED_PART, SPEED, AT_REST, VOLTS, PLACE = range(7)
"""Columns of the history: change of residual, g1, g2, velocity, 1 at rest, change of voltage,
position.
"""
_RIVALS = 11
SEEN_OVER = 4
"""Samples over which rest is seen: noise in one of them ends it for so many."""
LEAST_MOTION = SEEN_OVER + 1
"""Samples of motion between two stops."""
DRIFT, DRIFT_TIME = 6.0, 32
"""Distance in standard deviations of the position that a mass which sticks does not move within so
many samples. One that is loose, as with play between rod and mass, coasts slowly.
"""


class History(NamedTuple):
    """Ring of the newest samples, with the friction filter for the time since the onset."""

    rows: FloatArray
    head: NDArray[np.int64]
    b: FloatArray
    a: FloatArray


class Rest(NamedTuple):
    """Rest of the mass in one place.

    Args:
        share: of the samples.
        always: the smaller of the shares in the two halves of the samples.
        stops: number of separate stretches.
    """

    share: float
    always: float
    stops: int


class Evidence(NamedTuple):
    """Evidence from the samples since the onset.

    Args:
        explained: share of y² that friction explains.
        share: share of y² that the jump explains beyond the rivals; negative if the jump would
            supply energy.
        rho: correlation of the jump with the residual of the rivals.
        rest: share of the samples at rest.
        rest_always: the smaller of the shares at rest in the two halves of the samples.
        stops: number of separate stretches at rest.
        rivals: share of y² that the rivals explain.
        jump: energy explained by the jump beyond the rivals [(m/s^2)^2].
        together: share of y² that rivals and jump explain together.
        dry: share of y² in the Coulomb part of the friction fit, zero if θ1 is negative.
        peak: share of y² in its largest sample; near 1 for a spike.
    """

    explained: float
    share: float
    rho: float
    rest: float
    rest_always: float
    stops: int
    rivals: float
    jump: float
    together: float
    dry: float
    peak: float


def new_history(b: FloatArray, a: FloatArray) -> History:
    """An empty history for the friction filter b/a, padded to equal length."""
    return History(np.zeros((HISTORY, 7)), np.zeros(1, np.int64), b, a)


@part(inline="always")
def store_sample(  # noqa: PLR0917
    history: History,
    y: float,
    g1: float,
    g2: float,
    speed: float,
    rest: float,
    volts: float,
    place: float,
) -> None:
    """Store one sample."""
    row = history.rows[history.head[0]]
    row[Y], row[SIGN_PART], row[SPEED_PART], row[SPEED] = y, g1, g2, speed
    row[AT_REST], row[VOLTS], row[PLACE] = rest, volts, place
    head = history.head[0] + 1
    history.head[0] = head if head < HISTORY else 0


@part(allocates=True)
def evidence_of(history: History, ref: Reference, seq: int, since: int, count: int) -> Evidence:
    """Evidence of the newest `count` samples.

    Args:
        history: the newest samples, the last of them number `seq`.
        ref: one period of the healthy rig.
        since: samples since the onset of the change; the regressors start from rest there if the
            onset is still stored.
        count: number of samples judged, at most HISTORY and `since`.
    """
    n = min(count, HISTORY)
    data = np.zeros((n, _RIVALS + 3))
    _fill_rivals(data, ref, seq, n)
    _fill_friction(data, history, since, n)
    peak = 0.0
    for k in range(n):
        at = (history.head[0] - n + k) % HISTORY
        data[k, _RIVALS + 2] = history.rows[at, Y]
        peak = max(peak, history.rows[at, Y] ** 2)
    return _compare(data.T @ data, rest_of(history, n, ref.levels.position_noise), peak)


@part(allocates=True)
def rest_of(history: History, n: int, noise: float) -> Rest:
    """Rest in one place over the newest `n` samples; stretches in which the mass drifts are none.

    Args:
        history: the newest samples.
        n: number of samples.
        noise: standard deviation of the position [m].
    """
    rows, first = history.rows, history.head[0] - n
    stops, halves = 0, np.zeros(2)
    # The stretch at rest: its first sample, its extent, and its samples in both halves.
    begin, low, high, drifts, inside = 0, 0.0, 0.0, True, np.zeros(2)
    moving = LEAST_MOTION
    for k in range(n):
        moving += 1
        if rows[(first + k) % HISTORY, AT_REST] == 0.0:
            continue
        place = rows[(first + k) % HISTORY, PLACE]
        low, high = min(low, place), max(high, place)
        far = high - low > DRIFT * noise
        if moving > LEAST_MOTION or (far and k - begin > DRIFT_TIME):
            if not drifts:
                halves[0] += inside[0]
                halves[1] += inside[1]
                stops += 1
            begin, low, high, drifts = k, place, place, False
            inside[0] = inside[1] = 0.0
            for before in range(max(k - SEEN_OVER + 1, 0), k):
                place = rows[(first + before) % HISTORY, PLACE]
                low, high = min(low, place), max(high, place)
        elif far:
            drifts = True
        inside[1 if 2 * k >= n else 0] += 1.0
        moving = 0
    if not drifts:
        halves[0] += inside[0]
        halves[1] += inside[1]
        stops += 1
    return Rest((halves[0] + halves[1]) / n, 2.0 * min(halves[0], halves[1]) / n, stops)


@part()
def swing_of_voltage_change(history: History, count: int) -> float:
    """Standard deviation of the change of voltage over the newest `count` samples [V]."""
    mean = square = 0.0
    for k in range(count):
        volts = history.rows[(history.head[0] - 1 - k) % HISTORY, VOLTS]
        mean += volts / count
        square += volts * volts / count
    return np.sqrt(max(square - mean * mean, 0.0))


@part()
def _fill_rivals(data: FloatArray, ref: Reference, seq: int, n: int) -> None:
    period = ref.counts.period
    mean = 0.0
    for place in range(period):
        mean += ref.template[1, place] / period
    swing = max(ref.levels.position_swing, 1e-12)
    for k in range(n):
        place = place_in_period(ref, seq - n + 1 + k)
        later, earlier = (place + 1) % period, (place - 1) % period
        # Smooth changes of the healthy motion: acceleration by gain and phase, stiffness, damping,
        # offset, the gain and phase drifting over the window, nonlinear stiffness and damping.
        data[k, 0] = ref.template[2, place]
        data[k, 1] = ref.template[2, later] - ref.template[2, earlier]
        data[k, 2] = x = (ref.template[1, place] - mean) / swing
        data[k, 3] = dx = (ref.template[1, later] - ref.template[1, earlier]) / swing
        data[k, 4] = 1.0
        time = (k + 0.5) / n - 0.5
        data[k, 5] = time * data[k, 0]
        data[k, 6] = time * data[k, 1]
        data[k, 7], data[k, 8], data[k, 9], data[k, 10] = x * x, x * dx, x * x * x, x * x * dx


@part(allocates=True)
def _fill_friction(data: FloatArray, history: History, since: int, n: int) -> None:
    rows, head = history.rows, history.head[0]
    if since >= HISTORY:
        for k in range(n):
            at = (head - n + k) % HISTORY
            data[k, _RIVALS] = rows[at, SIGN_PART]
            data[k, _RIVALS + 1] = rows[at, SPEED_PART]
        return
    # The onset is still stored: friction did not act before it, so its filter starts from rest.
    order = max(history.b.size - 1, 1)
    sign_state, speed_state = np.zeros(order), np.zeros(order)
    for k in range(since):
        speed = rows[(head - since + k) % HISTORY, SPEED]
        sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
        g1 = filter_sample(history.b, history.a, sign_state, sign)
        g2 = filter_sample(history.b, history.a, speed_state, speed)
        place = k - (since - n)
        if place >= 0:
            data[place, _RIVALS], data[place, _RIVALS + 1] = g1, g2


@part()
def _compare(gram: FloatArray, rest: Rest, peak: float) -> Evidence:
    """Evidence from the normal matrix of rivals, friction regressors and y, in this order."""
    yy = max(gram[-1, -1], 1e-30)
    explained, dry = _friction_fit(gram, yy)
    remains, jump, sign = _gain_over_rivals(gram)
    rho = sign * np.sqrt(min(jump / remains, 1.0)) if remains > 0.0 else 0.0
    return Evidence(
        explained,
        sign * jump / yy,
        rho,
        rest.share,
        rest.always,
        rest.stops,
        1.0 - remains / yy,
        jump,
        1.0 - (remains - jump) / yy,
        dry,
        peak / yy,
    )


@part()
def _friction_fit(gram: FloatArray, yy: float) -> tuple[float, float]:
    """Shares of y² explained by both friction terms and contained in the Coulomb term alone."""
    y, g1, g2 = gram.shape[0] - 1, _RIVALS, _RIVALS + 1
    determinant = gram[g1, g1] * gram[g2, g2] - gram[g1, g2] ** 2
    # At nearly constant speed both terms are parallel: the window cannot separate them.
    if determinant <= 1e-12 * gram[g1, g1] * gram[g2, g2]:
        return 0.0, 0.0
    theta1 = (gram[g2, g2] * gram[g1, y] - gram[g1, g2] * gram[g2, y]) / determinant
    theta2 = (gram[g1, g1] * gram[g2, y] - gram[g1, g2] * gram[g1, y]) / determinant
    explained = (theta1 * gram[g1, y] + theta2 * gram[g2, y]) / yy
    return explained, max(theta1, 0.0) ** 2 * gram[g1, g1] / yy


@part(allocates=True)
def _gain_over_rivals(gram: FloatArray) -> tuple[float, float, float]:
    """Residual energy of the rivals, the part of it that the jump explains, and the jump's sign."""
    y, g1 = gram.shape[0] - 1, _RIVALS
    # After eliminating the rivals, the remaining entries are inner products of what they leave.
    left = gram.copy()
    for i in range(_RIVALS):
        _eliminate(left, i, 1e-9 * gram[i, i])
    remains = max(left[y, y], 0.0)
    jump = 0.0
    # A jump that the rivals reproduce to rounding has no part of its own to test.
    if left[g1, g1] > 1e-9 * max(gram[g1, g1], 1e-30) and remains > 0.0:
        jump = left[g1, y] ** 2 / left[g1, g1]
    return remains, jump, 1.0 if left[g1, y] > 0.0 else -1.0


@part(allocates=True)
def _eliminate(gram: FloatArray, pivot: int, least: float) -> None:
    """Project column `pivot` out of all columns; a column already explained is skipped."""
    strength = gram[pivot, pivot]
    if strength <= least or strength <= 0.0:
        return
    size = gram.shape[0]
    row = gram[pivot].copy()
    for i in range(size):
        factor = row[i] / strength
        for j in range(size):
            gram[i, j] -= factor * row[j]
