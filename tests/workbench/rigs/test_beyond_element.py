"""A fault in series with what the healthy machine has: on which side of it is found and kept.

The machine is a slide whose drive has play when healthy. Its fault is a dead zone of the drive,
before the play or behind it.
"""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.physics.engine.equations import library
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import explained
from rigwatch.workbench.ranking.series_order import order_matters
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.fits.test_strength_intervals import MODEL, PERIOD, RATE, drive
from tests.workbench.machine import Table, studied, with_healthy
from tests.workbench.simulated import COMMON, knowing

DRIVEN = MODEL.replace("w*(g*u - q)", "w*(g*drive - q)") + (
    '[ports.drive]\nkind = "actuator"\nsignal = "u"\n'
)
UNITS = {"u": "N", "position": "m", "acceleration": "m/s^2"}
PLAY, DEAD = 0.4, 0.5
"""Half the play of the healthy drive and of the fault's dead zone [N]."""
STEPS, PERIODS = 16, 4
M, C, K, GAIN, FAST = 0.25, 0.6, 60.0, 1.2, 80.0
QUIET = {"position": 2e-6, "acceleration": 0.02}
"""Noise of the channels."""


def dead(force: float, half: float) -> float:
    """What passes a dead zone."""
    return force - min(max(force, -half), half)


def table(seed: int, before: float, behind: float) -> Table:
    """A recording of the slide with dead zones before and behind the play of its drive."""
    u = drive(seed, PERIODS)
    passed, held = np.empty_like(u), 0.0
    for at, force in enumerate(u):
        came = dead(force, before)
        held = min(max(held, came - PLAY), came + PLAY)
        passed[at] = dead(held, behind)
    x, v, q, dt = 0.0, 0.0, 0.0, 1 / RATE / STEPS
    rows = np.empty((len(u), 2))
    for at, force in enumerate(passed):
        rows[at] = x, (q - C * v - K * x) / M
        for _ in range(STEPS):
            # The drive's lag is exact; the slide takes a symplectic step.
            q = GAIN * force + (q - GAIN * force) * np.exp(-FAST * dt)
            v += dt * (q - C * v - K * x) / M
            x += dt * v
    noise = np.random.default_rng(100 + seed).normal(size=rows.shape) * list(QUIET.values())
    position, acceleration = (rows + noise)[PERIOD:].T
    return dict(zip(UNITS, (u[PERIOD:], position, acceleration), strict=True))


def study_of(folder: Path, before: float, behind: float) -> Study:
    """The study of a slide with a dead zone, on a base with the play of the healthy one."""
    train, held_out = ([table(seed, before, behind)] for seed in range(2))
    keys = f'variants = ["valve_hysteresis@drive(b={0.8 * PLAY})"]'
    made = studied(folder, DRIVEN, train, held_out, UNITS, keys, rates=[RATE] * 2)
    return with_healthy(made, table(2, 0.0, 0.0), UNITS, RATE)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("before", "behind", "side"),
    [
        (0.0, DEAD, "valve_hysteresis"),
        (DEAD, 0.0, ""),
    ],
)
def test_the_side_of_the_play_on_which_a_dead_zone_lies_is_found_and_kept(
    tmp_path: Path, before: float, behind: float, side: str
) -> None:
    study = study_of(tmp_path, before, behind)
    found = explained(open_bench(knowing(study, "valve_hysteresis", *COMMON)))
    best = found.explanation.ranking[0]
    assert found.explanation.verdict == "missing_effect", found.explanation.text
    assert (best.effect, best.port) == ("dead_band", "drive")
    told = "it acts on what has passed the valve_hysteresis" in found.explanation.text
    assert told == bool(side)
    assert best.parameters["b"].value == pytest.approx(DEAD, rel=0.05)
    assert main(["add", str(study.folder), "dead_band@drive"]) == 0
    kept = open_study(study.folder)
    assert kept.file.effects[-1].beyond == side
    # On the other side of the play it leaves a tenth and more of the error.
    assert open_bench(kept).base.held_out_error < 0.03 * found.bench.base.held_out_error


def test_the_order_of_what_is_linear_does_not_matter() -> None:
    known = library()
    assert not order_matters(known["lag"], known["gain"])
    assert not order_matters(known["delay"], known["lag"])
    assert order_matters(known["lag"], known["saturation"])
    assert order_matters(known["valve_hysteresis"], known["dead_band"])
    assert order_matters(known["asymmetry"], known["gain"])
