"""Hidden states that short windows hardly determine: judged on what is held out all the same."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit.continued_windows import continued
from rigwatch.physics.engine.fit.problem import Problem
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files.loading import parse

RUNAWAY = """
name = "runaway"
summary = "a speed that returns to what drives it, and runs away beyond a limit"
hold = "zero"
inputs.u = { unit = "1" }
states.x = { unit = "m", derivative = "s", measured = "x" }
states.s = { unit = "m/s", derivative = "w*(g*u - s + s**3/q)" }
parameters.w = { value = 1.0, unit = "1/s", fixed = true }
parameters.g = { value = 0.3, unit = "m/s", fixed = true }
parameters.q = { value = 1.0, unit = "m^2/s^2", fixed = true }
outputs.x = { unit = "m", expression = "x" }
"""
DT, NOISE, LENGTH = 0.05, 0.3, 4


def problem() -> Problem:
    """Windows in which the noise of the place leaves the speed open by ten times its size."""
    generator = np.random.default_rng(0)
    drive = np.repeat(generator.normal(size=50), 8)
    x = s = 0.0
    place = np.empty(len(drive))
    for at, u in enumerate(drive):
        place[at] = x
        for _ in range(50):
            s += DT / 50 * (0.3 * u - s + s**3)
            x += DT / 50 * s
    read = place + NOISE * generator.normal(size=len(drive))
    compiled = compile_system(compose(parse(RUNAWAY, Model, "runaway")))
    recording = Recording(DT, drive[:, None], read[:, None])
    return Problem(
        compiled, recording, LENGTH, scale=np.array([NOISE]), substeps=2, initial=None
    )  # fmt: skip


def test_they_are_led_through_the_windows_where_one_diverges_from_the_one_before() -> None:
    judged = problem()
    parameters = judged.compiled.parameters
    judged.recall(parameters)
    with np.errstate(over="ignore"):
        found = continued(judged, parameters)
    # One of four samples' freedom goes to the place at which each window begins.
    assert float(np.sqrt(np.mean(found.error**2))) == pytest.approx(np.sqrt(3 / 4), rel=0.1)


def test_a_model_that_runs_away_from_the_true_states_is_an_error() -> None:
    judged = problem()
    parameters = judged.compiled.vector({"w": 1e4})
    judged.recall(parameters)
    with pytest.raises(ModelError, match="diverged"):
        continued(judged, parameters)
