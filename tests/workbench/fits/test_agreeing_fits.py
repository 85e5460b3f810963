"""Two fits agree if they reached one optimum: by their errors, or by their parameters."""

from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit import Fit, Recording, evaluate, fit
from rigwatch.physics.engine.search.convergence import agrees, convergence

LINE = """
name = "line"
summary = "A line."
inputs.u = { unit = "V" }
parameters.slope = { value = 1.0, unit = "1" }
outputs.y = { unit = "V", expression = "slope*u" }
"""
INPUT = np.linspace(-1.0, 1.0, 200)
NOISE = 0.1 * np.random.default_rng(3).standard_normal(200)
RECORDING = Recording(0.01, INPUT[:, None], (2.0 * INPUT + NOISE)[:, None])


def fitted(slope: float | None = None) -> Fit:
    """The fit, or one that stopped at another slope."""
    compiled = compile_system(compose(parse_model(LINE, "line.toml")))
    found = fit(compiled, RECORDING, len(INPUT))
    if slope is None:
        return found
    found.parameters[:] = slope
    return evaluate(found, RECORDING, len(INPUT))


def higher(found: Fit) -> Fit:
    """The same parameters at a stop of a rough error, a fifth above."""
    return replace(found, residuals=1.2 * found.residuals)


def test_nearly_the_same_parameters_agree_at_different_errors() -> None:
    best = fitted()
    near = float(best.parameters[0]) * 1.005
    assert agrees(higher(fitted(near)), best)


def test_other_parameters_do_not_agree() -> None:
    best = fitted()
    apart = fitted(float(best.parameters[0]) * 1.1)
    assert not agrees(apart, best)
    ended = convergence(best, [apart], "a start", near_noise=False)
    assert not ended.converged
    assert "none of 2 starts" in ended.reason
