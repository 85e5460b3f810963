"""A damper in a testing machine: a ram moves it along a path, a load cell reads the force.

    F = c·v + k·x + hidden

The path is a sum of sines, so speed is exact; a displacement sensor reads the path. A dry element
is a spring in series with a slider, integrated exactly from step to step (return
mapping); it may sit behind a gap. 20 steps a sample.

Symbols: x displacement [m], v speed [m/s], F force [N].
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel

RATE = 200.0
"""Samples a second."""
STEPS = 20
DAMPING, STIFFNESS = 900.0, 12e3
"""[N s/m], [N/m]."""
ELEMENT = 3e4
"""Stiffness of the spring in series with the slider [N/m]."""
STOP = 0.018
"""Displacement at which the bump stop begins [m]."""
YIELD = 4e-3
"""Displacement at which the yielding joint gives way [m]."""
GAP = 3e-3
"""Half of the gap in front of a slider with a gap [m]."""
EFFECTS = (
    "slider", "slider_behind_gap", "joint", "preload", "hardening", "bump_stop", "orifice",
    "one_way_valve", "cell_offset",
)  # fmt: skip
"""Names of the hidden effects, in the order of their strengths."""


@kernel()
def run(path: FloatArray, s: FloatArray, out: FloatArray) -> None:
    """Displacement [m] and force [N] at each sample.

    Args:
        path: displacement and speed at each step, shape (n·STEPS, 2).
        s: strengths of `EFFECTS`.
        out: shape (n, 2).
    """
    bent, behind, carried, yielded = 0.0, 0.0, 0.0, 0.0
    before = path[0, 0]
    for k in range(len(path)):
        x, v = path[k, 0], path[k, 1]
        moved = x - before
        before = x
        bent = max(-s[0], min(s[0], bent + ELEMENT * moved))
        # The far side of the gap moves along as soon as one of its walls touches.
        last = carried
        carried = min(max(carried, x - GAP), x + GAP)
        behind = max(-s[1], min(s[1], behind + ELEMENT * (carried - last)))
        share = yielded / YIELD
        yielded += moved - 0.5 * abs(moved) * share * abs(share) - 0.5 * moved * share**2
        force = DAMPING * v + STIFFNESS * x + bent + behind + s[2] * yielded / YIELD
        force += s[3] + s[4] * x**3 + s[6] * v * abs(v) + s[7] * abs(v) + s[8]
        if abs(x) > STOP:
            force += s[5] * (x - np.sign(x) * STOP)
        if k % STEPS == 0:
            out[k // STEPS, 0] = x
            out[k // STEPS, 1] = force


def drive(seed: int, samples: int = 2400) -> FloatArray:
    """A path of sines from 0.2 to 2.5 Hz that begins at rest, shape (samples·STEPS, 2)."""
    random = np.random.default_rng(seed)
    time = np.arange(samples * STEPS) / (RATE * STEPS)
    lines = 2 * np.pi * np.arange(0.2, 2.5, 0.1)
    sizes = 0.04 / (1 + lines / 4) / np.sqrt(len(lines))
    phases = random.uniform(0, 2 * np.pi, len(lines))
    angles = np.outer(time, lines) + phases
    x, v = np.sin(angles) @ sizes, np.cos(angles) @ (sizes * lines)
    begins, rate = np.minimum(time / 0.5, 1.0), np.where(time < 0.5, 2.0, 0.0)
    rises = begins**2 * (3 - 2 * begins)
    return np.stack([x * rises, v * rises + x * 6 * begins * (1 - begins) * rate], axis=1)
