"""A slide on a spring behind a lagging motor, with what may be hidden in it, and studies of it.

Model, excitation and noise are those of `tests/workbench/verdicts/test_refinements.py`.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.compare import Bench, open_bench
from tests.workbench.machine import studied, with_healthy
from tests.workbench.verdicts.test_refinements import MODEL, RATE, UNITS, Machine, run

MIDDLE, HALF_WIDTH, SPEED = 0.004, 0.01, 60.0
"""Middle of spring and guide [m], half width of a dent [m], rate of the healthy motor [1/s]."""
RAMP = 0.006
"""Travel over which a tight part of the guide begins [m]."""


class Hidden(NamedTuple):
    """What is hidden at strength 1.

    Attributes:
        cubic: stiffness about the middle [N/m^3].
        binding: friction by the distance from the middle [N/m].
        dry: friction [N].
        dent: friction at the dent's middle [N], which falls as a raised cosine.
        tight: friction on a part of the travel [N], which begins in a straight ramp.
        side: +1 if that part is above the place, -1 below, 0 on either side.
        place: of the dent, or where the tight part begins [m].
        slower, weaker: shares by which the motor is.
    """

    cubic: float = 0.0
    binding: float = 0.0
    dry: float = 0.0
    dent: float = 0.0
    tight: float = 0.0
    side: float = 1.0
    place: float = 0.0
    slower: float = 0.0
    weaker: float = 0.0


@kernel()
def law(x: float, v: float, hidden: Hidden) -> float:
    """Force of what is hidden in the slide [N]."""
    near = min(abs(x - hidden.place) / HALF_WIDTH, 1.0)
    rubbing = hidden.binding * abs(x - MIDDLE) + hidden.dry
    rubbing += hidden.dent * 0.5 * (1.0 + np.cos(np.pi * near))
    away = x - hidden.place
    away = abs(away) if hidden.side == 0.0 else hidden.side * away
    rubbing += hidden.tight * min(max(away / RAMP, 0.0), 1.0)
    return float(-hidden.cubic * (x - MIDDLE) ** 3 - rubbing * np.tanh(v / 1e-4))


@kernel(allocates=True)
def _moved(u: np.ndarray, strength: float, steps: int, h: float, hidden: Hidden) -> np.ndarray:
    """Position and acceleration at each sample."""
    out = np.zeros((u.size, 2))
    rate = SPEED * (1.0 - strength * hidden.slower)
    x = v = s = 0.0
    for n in range(u.size):
        drive = (1.0 - strength * hidden.weaker) * u[n]
        for j in range(steps):
            a = s - 2.0 * v - 100.0 * x + strength * law(x, v, hidden)
            if j == 0:
                out[n, 0], out[n, 1] = x, a
            v += h * a
            x += h * v
            s += h * rate * (drive - s)
    return out


def slide(hidden: Hidden) -> Machine:
    """A simulation of it."""
    return lambda u, strength, steps, h: _moved(u, strength, steps, h, hidden)


def bench(folder: Path, hidden: Hidden, model: str = MODEL) -> Bench:
    """A study with a healthy recording, fitted."""
    machine = slide(hidden)
    train, held_out, healthy = (run(seed, float(seed < 2), machine=machine) for seed in range(3))
    made = studied(folder, model, [train], [held_out], UNITS, rates=[RATE, RATE])
    return open_bench(with_healthy(made, healthy, UNITS, RATE))
