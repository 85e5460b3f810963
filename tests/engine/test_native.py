"""A system's kernel: one for equal equations, the same numbers however windows are shared out."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile import kernel as native
from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose

MODEL = shipped_models()["mass-spring-damper"]
FRICTION = library()["coulomb"].scaled({"x": 0.1, "v": 1.0})


def simulated(compiled, windows):
    inputs = np.random.default_rng(3).normal(size=(windows * 20, 1))
    return compiled.simulate(
        inputs, 1 / 256, np.arange(windows) * 20, 20, initial=np.zeros((windows, 2)),
        parameters=compiled.parameters,
    )  # fmt: skip


@pytest.mark.parametrize("cores", [1, 2, 3, 9])
def test_cores_that_share_windows_give_the_numbers_of_one(monkeypatch, cores):
    compiled = compile_system(compose(MODEL, [Placement("coulomb", FRICTION, "load")]))
    alone = simulated(compiled, 7)
    monkeypatch.setattr(native, "LARGE", 0)
    monkeypatch.setattr(native, "cores", lambda: cores)
    shared = simulated(compiled, 7)
    np.testing.assert_array_equal(shared.outputs, alone.outputs)
    np.testing.assert_array_equal(shared.slopes, alone.slopes)


def test_equal_equations_share_a_kernel_and_others_do_not():
    first, again = (compile_system(compose(MODEL)).kernel for _ in range(2))
    other = compile_system(compose(MODEL, [Placement("coulomb", FRICTION, "load")])).kernel
    assert first is again
    assert other is not first
