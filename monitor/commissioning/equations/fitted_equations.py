"""Parameters of the equations from the first part of each healthy recording."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.signal import savgol_coeffs

from monitor.commissioning.equations.healthy_fit import Stretches
from monitor.commissioning.equations.sensor_chain import fit_sensor
from monitor.commissioning.equations.variant_search import fit_with_variants
from monitor.commissioning.unhealthy import STARTED, white_noise
from monitor.model import (
    EquationsPlant,
)
from monitor.observer import (
    EMPTY,
    LaggedSignals,
    Layout,
    base_model,
    force_port,
    layout_of,
)
from monitor.signals import GOOD, NEW_BOOT, Codes, Recording
from rigwatch.physics.transfer import lateness
from rigwatch.wire.arrays import FloatArray

FITTED, CHIRP = 6.5, 14.5
"""Length of the fitted part of a recording, and of one with a frequency sweep [s]."""
TURNS = 4.0
"""Multiple of the speed's noise indistinguishable from rest."""


def half_width_of(name: str) -> int:
    """Half the width of the kernel that smooths the motion, of a shipped model [samples]."""
    return EquationsPlant(model=name, names=(), values=(), port="").half_width


def fitted_equations(  # noqa: PLR0917 -- all that is known
    used: Sequence[Recording],
    name: str,
    corner: float,
    rate: float,
    jitters: Sequence[bool],
    stated: Mapping[str, float],
    say: Callable[[str], None] = lambda _: None,
) -> EquationsPlant:
    """The equations with parameters from the first part of each recording.

    Args:
        used: recordings.
        name: of the equations.
        corner: of the high-pass [Hz].
        rate: sample rate [Hz].
        jitters: of which recordings the inputs' steps jitter.
        stated: parameters that are known, in SI.
        say: called with one line at each step.
    """
    model = base_model(name)
    port = force_port(model)
    layout = layout_of(model, port)
    lag = half_width_of(name)
    late = _lateness(used, layout, rate)
    moved = [
        motion_of(one, layout, lag, rate, late, each)
        for one, each in zip(used, jitters, strict=True)
    ]
    n = layout.inputs
    motions = [(m[:, :n], m[:, n], m[:, n + 1]) for m in moved]
    known = fit_sensor(model, motions, rate, stated) | dict(stated)
    parts = [(np.ascontiguousarray(m[:, :n]), np.ascontiguousarray(m[:, [n]])) for m in moved]
    fitted = [round((CHIRP if one.role == "chirp" else FITTED) * rate) for one in used]
    turn = TURNS * _speed_noise(used, layout, lag, rate)
    noise = min(white_noise(one.channel(layout.channels[-1])) for one in used)
    data = Stretches(port, parts, fitted, turn, corner, rate, noise, known)
    variants, found = fit_with_variants(model, data, say)
    return EquationsPlant(
        model=name, variants=variants, names=tuple(found.values),
        values=tuple(found.values.values()), port=port, coulomb=found.coulomb,
        turn=turn, half_width=lag, late=late, corner=corner,
    )  # fmt: skip


def _lateness(used: Sequence[Recording], layout: Layout, rate: float) -> float:
    """Lateness of the motion behind the sensor of its rate [s], from the started recordings."""
    column, output = layout.balance, layout.channels[-1]
    begin = round(STARTED * rate)
    pairs = [
        (one.channel(layout.channels[column.channel])[begin:], one.channel(output)[begin:])
        for one in used
    ]
    return lateness(pairs, 1.0 / rate, column.order)


def motion_of(  # noqa: PLR0917
    one: Recording, layout: Layout, lag: int, rate: float, late: float, jitters: bool
) -> FloatArray:
    """Columns of the inputs and the smoothed motion, shape (n, columns).

    Args:
        one: recording.
        layout: of the columns.
        lag: half the kernel's width [samples].
        rate: sample rate [Hz].
        late: lateness of the motion behind its sensor [s].
        jitters: whether the inputs' steps jitter.
    """
    signals = LaggedSignals(layout, lag, rate, late, jitters)
    columns, state, _ = signals.update(*admitted(one, layout))
    return np.ascontiguousarray(columns[state != EMPTY])


def admitted(one: Recording, layout: Layout) -> tuple[FloatArray, Codes]:
    """Signals of a recording, shape (n, channels), and their codes of the admission, shape (n,)."""
    signals = np.column_stack([one.channel(name) for name in layout.channels])
    code = np.full(len(signals), GOOD, np.int64)
    code[0] = NEW_BOOT
    return signals, code


def _speed_noise(used: Sequence[Recording], layout: Layout, lag: int, rate: float) -> float:
    column = layout.columns[layout.speed]
    channel = layout.channels[column.channel]
    kernel = savgol_coeffs(2 * lag + 1, 3, deriv=column.order, delta=1.0 / rate)
    noises = [white_noise(one.channel(channel)) for one in used]
    return max(min(noises) * float(np.linalg.norm(kernel)), 1e-9)
