"""A fit at a corner of its error has converged; one that was stopped on a slope has not."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit import Fit, Recording, evaluate, fit
from rigwatch.physics.engine.search.convergence import PROMISED, promise
from rigwatch.physics.engine.search.promised_step import kept_promise
from rigwatch.wire.arrays import FloatArray

LIMITED = """
name = "limited"
summary = "A signal that is limited."
inputs.u = { unit = "V" }
parameters.top = { value = 1.0, unit = "V" }
outputs.y = { unit = "V", expression = "min(u, top)" }
"""
LEVELS = np.repeat([1.0, 2.0, 3.0], 20)
READ = np.repeat([1.0, 3.0, 1.5], 20)
"""What a limit explains badly: the error has a corner where it meets the second level."""


def stopped(top: float, read: FloatArray = READ) -> tuple[Fit, Recording]:
    """A fit with the limit at `top`, and its recording."""
    recording = Recording(0.01, LEVELS[:, None], read[:, None])
    compiled = compile_system(compose(parse_model(LIMITED, "limited.toml")))
    found = fit(compiled, recording, len(LEVELS), start=np.array([top]))
    found.parameters[:] = top
    return evaluate(found, recording, len(LEVELS)), recording


def kept(top: float, read: FloatArray = READ) -> tuple[float, float]:
    found, recording = stopped(top, read)
    return promise(found), kept_promise(found, recording, len(LEVELS), 1)


def test_the_promise_of_a_corner_is_not_kept() -> None:
    promised, found = kept(2.0 - 1e-6)
    assert promised > PROMISED
    assert found < PROMISED


def test_the_promise_of_a_slope_is_kept() -> None:
    promised, found = kept(1.2)
    assert promised > PROMISED
    assert found == pytest.approx(promised, rel=0.05)


def test_a_minimum_promises_nothing() -> None:
    promised, found = kept(2.5, np.minimum(LEVELS, 2.5) + np.tile([0.1, -0.1], 30))
    assert found == promised < PROMISED
