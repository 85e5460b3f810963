"""Integrates any system with exact sensitivities: the loops around the equations' machine code.

The state is z = [x | S], the states followed by the rows of their sensitivities, and

    dz/dt = rates(t, z, u, p)

is integrated by the classical fourth-order Runge-Kutta method with fixed steps. The equations, and
a whole step of them (`runge_kutta_step`), are passed as addresses of functions void(double t,
double* a, u, p, out, slopes), so these loops are compiled once for all systems.

A zero-order hold that is late by d samples changes within an interval. Steps end there, and where d
is a parameter the sensitivities to it change by what the rates were before less what they are
after: a change that comes later leaves the value before in force for as long.
"""

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from rigwatch.physics.engine.compile.step_size import ACCURATE, STABLE
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.kernel import kernel, part

_DOUBLE = ir.DoubleType()
TINY = 1e-200
"""Magnitude below which a state or sensitivity is set to zero."""
WIDE = 1.5
"""Allowed change of a state in an interval, relative to an Euler step."""
UNCHANGED = 0.9
"""Ratio of the least to the greatest slope in an interval in which a contact stays at rest."""
AT_REST = ACCURATE / STABLE
"""Steps for a contact at rest, relative to those for one that begins or ends to slip."""
DAMPED = 2.0
"""Rate times step beyond which a memory is slowed down: a Runge-Kutta step then leaves a third of a
disturbance, however fast the memory would return."""
DAMPED_BY_HEUN = 1.0
"""The same for sensitivities along a linearisation."""


def _call(  # noqa: PLR0917 -- numba wants them by name
    _context: Any, address: Any, t: Any, a: Any, u: Any, p: Any, out: Any, slopes: Any
) -> Any:
    signature = types.void(address, t, a, u, p, out, slopes)

    def generate(_context: Any, builder: Any, _signature: Any, values: Any) -> None:
        pointer = _DOUBLE.as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [_DOUBLE, *[pointer] * 5])
        function = builder.inttoptr(values[0], kind.as_pointer())
        builder.call(function, [values[1], *(builder.inttoptr(v, pointer) for v in values[2:])])

    return signature, generate


call: Any = intrinsic(_call)
"""call(address, t, a, u, p, out, slopes): arrays are passed by their address."""


@part(allocates=True, error_model="numpy")
def input_rows(u: FloatArray, count: int) -> FloatArray:
    """Rows for inputs, the time until held ones change, and the fastest rate of a memory."""
    rows = np.empty((count, u.shape[1] + 2))
    rows[:, u.shape[1] + 1] = math.inf
    return rows


@part(error_model="numpy")
def whole_samples(held: float) -> float:
    """Whole samples by which a hold is late; what is left of a late one is above 0, and up to 1."""
    return max(math.ceil(-held) - 1.0, 0.0)


@part(error_model="numpy")
def place(  # noqa: PLR0917 -- a kernel
    u: FloatArray, row: int, oldest: int, at: float, inside: float, hold: FloatArray, rows: int,
    dt: float, us: FloatArray,
) -> None:  # fmt: skip
    """Inputs between two samples, and the time until held inputs change.

    `hold` is 1 for a linear input, 0 for a zero-order hold, and -d for a zero-order hold delayed by
    d samples; before row `oldest` it has the value of that row. `inside`: a step ending at a change
    uses the value before it.
    """
    # The entry after the inputs is the time until held inputs change.
    us[u.shape[1]] = 0.0
    for j in range(u.shape[1]):
        if hold[j] > 0.0:
            us[j] = u[row, j]
            if at > 0.0:
                us[j] += at * (u[row + 1, j] - u[row, j])
            continue
        behind = whole_samples(hold[j])
        change = -hold[j] - behind
        us[u.shape[1]] = (rows - row % rows - at + change) * dt
        # Before its delayed update an input still has the previous sample's value.
        if inside < change:
            behind += 1.0
            us[u.shape[1]] = max(change - at, 0.0) * dt
        us[j] = u[max(row - int(behind), oldest), j]


@part(error_model="numpy")
def advance(  # noqa: PLR0917 -- a kernel
    step: int, u: FloatArray, row: int, oldest: int, start: float, end: float, hold: FloatArray,
    rows: int, now: float, dt: float, pp: int, z: FloatArray, us: FloatArray, times: FloatArray,
) -> None:  # fmt: skip
    """One Runge-Kutta step between two fractions of a sample; updates z in place.

    `now` is the time of the first sample. `us` holds the inputs at the start, in the middle and at
    the end, `times` what `step` expects.
    """
    middle = 0.5 * (start + end)
    # Inputs at both ends are chosen as inside the step: a jump at an end is not part of it.
    place(u, row, oldest, start, middle, hold, rows, dt, us[0])
    place(u, row, oldest, middle, middle, hold, rows, dt, us[1])
    place(u, row, oldest, end, middle, hold, rows, dt, us[2])
    for i in range(3):
        us[i, u.shape[1] + 1] = DAMPED / (dt * (end - start))
    times[0] = now + start * dt
    times[1] = now + middle * dt
    times[2] = now + end * dt
    times[3] = dt * (end - start)
    tp = times.ctypes.data
    call(step, 0.0, z.ctypes.data, us.ctypes.data, pp, tp, tp)


@part(error_model="numpy")
def next_change(hold: FloatArray, start: float) -> float:
    """Fraction of a sample, after `start`, at which the next held input changes; 1 if none does."""
    found = 1.0
    for held in hold:
        change = -held - whole_samples(held)
        if start < change < found:
            found = change
    return found


@part(error_model="numpy")
def across(  # noqa: PLR0917 -- a kernel
    step: int, plain: int, u: FloatArray, row: int, oldest: int, steps: int, hold: FloatArray,
    columns: IntArray, rows: int, now: float, dt: float, pp: int, z: FloatArray, us: FloatArray,
    times: FloatArray, before: FloatArray, after: FloatArray,
) -> None:  # fmt: skip
    """Integrate from one sample to the next, in steps that end where an input changes.

    `columns`: of the first inputs, those of the sensitivities to by how much they are late, -1 if
    that is fixed. `before` and `after` are room for rates, shape (n,) each.
    """
    # A step across the jump of a held input would reduce the method to first order.
    start = 0.0
    change(
        plain, u, row, oldest, 0.0, 0.0, hold, columns, rows, now, dt, pp, z, us, before, after,
    )  # fmt: skip
    while start < 1.0:
        end = next_change(hold, start)
        count = math.ceil(steps * (end - start))
        for k in range(count):
            first = start + (end - start) * k / count
            last = start + (end - start) * (k + 1) / count
            advance(step, u, row, oldest, first, last, hold, rows, now, dt, pp, z, us, times)
        change(
            plain, u, row, oldest, end, 0.5 * (start + end), hold, columns, rows, now, dt, pp, z,
            us, before, after,
        )  # fmt: skip
        start = end


@part(error_model="numpy")
def change(  # noqa: PLR0917 -- a kernel
    plain: int, u: FloatArray, row: int, oldest: int, at: float, inside: float, hold: FloatArray,
    columns: IntArray, rows: int, now: float, dt: float, pp: int, z: FloatArray, us: FloatArray,
    before: FloatArray, after: FloatArray,
) -> None:  # fmt: skip
    """Sensitivities to how late inputs are, where these change at a fraction of a sample."""
    n, inputs, placed = before.size, u.shape[1], False
    time, zp, m = now + at * dt, z.ctypes.data, z.size // before.size - 1
    for j in range(columns.size):
        behind = whole_samples(hold[j])
        new = row - int(behind)
        older, newer = u[max(new - 1, oldest), j], u[max(new, oldest), j]
        if -hold[j] - behind != at or older == newer:
            continue
        if not placed:
            place(u, row, oldest, at, inside, hold, rows, dt, us[0])
            us[0, inputs + 1] = DAMPED / dt
            for i in range(inputs + 2):
                us[1, i] = us[0, i]
            placed = True
        # One by one, inputs that change together add up to the change of all.
        us[0, j], us[1, j] = older, newer
        if columns[j] >= 0:
            call(plain, time, zp, us[0].ctypes.data, pp, before.ctypes.data, before.ctypes.data)
            call(plain, time, zp, us[1].ctypes.data, pp, after.ctypes.data, after.ctypes.data)
            for i in range(n):
                z[n + i * m + columns[j]] += before[i] - after[i]
        us[0, j] = newer


@part(error_model="numpy")
def renew(  # noqa: PLR0917 -- a kernel
    update: int, u: FloatArray, row: int, oldest: int, hold: FloatArray, rows: int, now: float,
    dt: float, pp: int, z: FloatArray, dz: FloatArray, us: FloatArray,
) -> None:  # fmt: skip
    """Update the states that change at samples."""
    place(u, row, oldest, 0.0, 0.0, hold, rows, dt, us)
    call(update, now, z.ctypes.data, us.ctypes.data, pp, dz.ctypes.data, dz.ctypes.data)
    for i in range(z.size):
        z[i] = dz[i]


@part(error_model="numpy")
def delay(hold: FloatArray, delays: IntArray, p: FloatArray, dt: float, held: FloatArray) -> None:
    """The holds in an interval: those of the first inputs are later by parameters."""
    for j in range(delays.size):
        held[j] = hold[j] - max(p[delays[j]], 0.0) / dt


@part(error_model="numpy")
def forget(z: FloatArray) -> None:
    """Set what has decayed to zero: numbers too small to be normal are a hundred times slower."""
    for i in range(z.size):
        if abs(z[i]) < TINY:
            z[i] = 0.0


@part(error_model="numpy")
def restart(z: FloatArray, x0: FloatArray, w: int, m: int) -> None:
    """Initial states of window w; the sensitivity to the initial states is the identity."""
    n = x0.shape[1]
    # Loops, here and below: numba takes seconds to compile assignments of whole slices.
    for i in range(z.size):
        z[i] = 0.0
    # Sensitivities follow the states, a row of m for each; its last n are by initial states.
    for i in range(n):
        z[i] = x0[w, i]
        z[n + i * m + m - n + i] = 1.0


@part(error_model="numpy")
def needed(  # noqa: PLR0917 -- a kernel
    plain: int, pace: int, crossing: IntArray, u: FloatArray, row: int, oldest: int,
    hold: FloatArray, rows: int, now: float, dt: float, pp: int, z: FloatArray, dx: FloatArray,
    end: FloatArray, near: FloatArray, rates: FloatArray, us: FloatArray,
) -> float:  # fmt: skip
    """Number of steps that `pace` requires in the next interval.

    Evaluated at its start, at its end after one Euler step, and where the states in `crossing` come
    closest to zero. Where all three find the same steep slope, the contact is at rest: a mode that
    only decays, which needs to be stable. `rates` is room for what is asked, shape (3, asked).
    """
    n, up = dx.size, us.ctypes.data
    asked, least, most = rates
    ap = asked.ctypes.data
    for i in range(asked.size):
        least[i], most[i] = math.inf, 0.0
    place(u, row, oldest, 0.0, 0.0, hold, rows, dt, us)
    # The Euler step carries a memory no further than to where it slips.
    us[u.shape[1] + 1] = 1.0 / dt
    call(plain, now, z.ctypes.data, up, pp, dx.ctypes.data, dx.ctypes.data)
    for i in range(n):
        near[i] = z[i]
        end[i] = z[i] + dt * dx[i]
    # Friction and play are stiffest near zero, which the step may cross between its ends.
    for i in crossing:
        middle, reach = 0.5 * (z[i] + end[i]), 0.5 * WIDE * abs(end[i] - z[i])
        near[i] = math.copysign(max(abs(middle) - reach, 0.0), middle)
    for at, share in ((z, 0.0), (near, 0.0), (end, 1.0)):
        if share > 0.0:
            place(u, row, oldest, share, share, hold, rows, dt, us)
        call(pace, now + share * dt, at.ctypes.data, up, pp, ap, ap)
        for i in range(asked.size):
            least[i], most[i] = min(least[i], abs(asked[i])), max(most[i], abs(asked[i]))
    worst = 0.0
    for i in range(asked.size):
        at_rest = i < crossing.size and least[i] > UNCHANGED * most[i]
        worst = max(worst, most[i] * AT_REST if at_rest else most[i])
    return worst * dt


@kernel(allocates=True, error_model="numpy", nogil=True)
def simulate(  # noqa: PLR0917 -- a kernel
    step: int, read: int, plain: int, pace: int, update: int, updated: bool, asked: int,
    crossing: IntArray, delays: IntArray, columns: IntArray, m: int, rows: int, u: FloatArray,
    spacing: FloatArray, begins: IntArray, time: FloatArray, substeps: int, finest: int,
    hold: FloatArray, starts: IntArray, x0: FloatArray, p: FloatArray, y: FloatArray,
    dy: FloatArray, last: FloatArray,
) -> None:  # fmt: skip
    """Fill outputs y (windows, samples, outputs), slopes dy (…, m) and the last z of each window.

    `spacing` is the time from each row of `u` to the next, `begins` the first row of its recording,
    `time` that of the equations at each row. Held inputs change every `rows` rows; the first are
    late by the parameters `delays`, see `across` for their `columns`. Each interval uses `substeps`
    steps, or as many up to `finest` as the `asked` rates of `pace` require.
    """
    n, size = x0.shape[1], x0.shape[1] * (1 + m)
    dx, end, near, rates = np.empty(n), np.empty(n), np.empty(n), np.empty((3, asked))
    z, dz, times = np.empty(size), np.empty(size), np.empty(4)
    between, us = input_rows(u, 3), input_rows(u, 1)[0]
    wanted, held = y.shape[2], hold.copy()
    pp, out, slopes = p.ctypes.data, np.empty(wanted), np.empty(wanted * m)
    for w in range(starts.size):
        restart(z, x0, w, m)
        for k in range(y.shape[1]):
            row = starts[w] + k
            now, dt, oldest = time[row], spacing[row], begins[row]
            delay(hold, delays, p, dt, held)
            place(u, row, oldest, 0.0, 0.0, held, rows, dt, us)
            call(
                read, now, z.ctypes.data, us.ctypes.data, pp, out.ctypes.data, slopes.ctypes.data,
            )  # fmt: skip
            for o in range(wanted):
                y[w, k, o] = out[o]
                for j in range(m):
                    dy[w, k, o, j] = slopes[o * m + j]
            if k + 1 < y.shape[1]:
                steps = substeps
                if asked > 0 and finest > substeps:
                    wanted_steps = needed(
                        plain, pace, crossing, u, row, oldest, held, rows, now, dt, pp, z, dx,
                        end, near, rates, us,
                    )  # fmt: skip
                    steps = int(min(float(finest), max(float(substeps), math.ceil(wanted_steps))))
                across(
                    step, plain, u, row, oldest, steps, held, columns, rows, now, dt, pp, z,
                    between, times, dx, end,
                )  # fmt: skip
                # Sampled states change together with the held signals.
                if updated and (row + 1) % rows == 0:
                    renew(update, u, row + 1, oldest, held, rows, now + dt, dt, pp, z, dz, us)
                forget(z)
        for i in range(size):
            last[w, i] = z[i]


@kernel(allocates=True, error_model="numpy", nogil=True)
def linearise(  # noqa: C901, PLR0912, PLR0917 -- a kernel
    plain_step: int, read_slopes: int, rate_slopes: int, update_slopes: int, delays: IntArray,
    u: FloatArray, spacing: FloatArray, begins: IntArray, time: FloatArray, substeps: int,
    hold: FloatArray, starts: IntArray, x0: FloatArray, p: FloatArray, nodes: FloatArray,
    slopes: FloatArray, y: FloatArray, dy: FloatArray, jumps: FloatArray,
) -> None:  # fmt: skip
    """The trajectory without sensitivities, and the Jacobians at its nodes."""
    n, wide = x0.shape[1], slopes.shape[3]
    z, times, between = np.empty(n), np.empty(4), input_rows(u, 3)
    us, wanted, pp, held = input_rows(u, 1)[0], y.shape[2], p.ctypes.data, hold.copy()
    out, flat = np.empty(max(wanted, n)), np.empty(max(wanted, n) * wide)
    zp, up, op, fp = z.ctypes.data, us.ctypes.data, out.ctypes.data, flat.ctypes.data
    for w in range(starts.size):
        for i in range(n):
            z[i] = x0[w, i]
        for k in range(y.shape[1]):
            row, last = starts[w] + k, k + 1 == y.shape[1]
            now, dt, oldest = time[row], spacing[row], begins[row]
            us[u.shape[1] + 1] = DAMPED_BY_HEUN * substeps / dt
            delay(hold, delays, p, dt, held)
            for step in range(1 if last else substeps):
                share = step / substeps
                place(u, row, oldest, share, share, held, 1, dt, us)
                if step == 0:
                    call(read_slopes, now, zp, up, pp, op, fp)
                    for o in range(wanted):
                        y[w, k, o] = out[o]
                        for j in range(wide):
                            dy[w, k, o, j] = flat[o * wide + j]
                node = k * substeps + step
                call(rate_slopes, now + share * dt, zp, up, pp, op, fp)
                for i in range(n):
                    nodes[w, node, i] = z[i]
                    for j in range(wide):
                        slopes[w, node, i, j] = flat[i * wide + j]
                if not last:
                    while share < (step + 1) / substeps:
                        following = min(next_change(held, share), (step + 1) / substeps)
                        advance(
                            plain_step, u, row, oldest, share, following, held, 1, now, dt, pp,
                            z, between, times,
                        )  # fmt: skip
                        share = following
            if jumps.shape[1] > 0 and not last:
                place(u, row + 1, oldest, 0.0, 0.0, held, 1, dt, us)
                call(update_slopes, now + dt, zp, up, pp, op, fp)
                for i in range(n):
                    z[i] = out[i]
                    for j in range(wide):
                        jumps[w, k + 1, i, j] = flat[i * wide + j]
