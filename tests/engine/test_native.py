"""A system's kernel: one for equal equations, the same numbers however windows are shared out."""

import time
from ctypes import CFUNCTYPE, c_double, c_void_p
from threading import Barrier

import numpy as np
import pytest

from rigwatch.physics.engine.compile import all_cores, llvm, turns
from rigwatch.physics.engine.compile import kernel as native
from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.compile.turns import side_by_side
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.wire.errors import ModelError

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
    monkeypatch.setattr(all_cores, "cores", lambda: cores)
    shared = simulated(compiled, 7)
    np.testing.assert_array_equal(shared.outputs, alone.outputs)
    np.testing.assert_array_equal(shared.slopes, alone.slopes)


def test_equal_equations_share_a_kernel_and_others_do_not():
    first, again = (compile_system(compose(MODEL)).kernel for _ in range(2))
    other = compile_system(compose(MODEL, [Placement("coulomb", FRICTION, "load")])).kernel
    assert first is again
    assert other is not first


@pytest.mark.parametrize("inlined", [0, 1000])
def test_a_step_in_machine_code_is_the_classical_one_bit_for_bit(monkeypatch, inlined):
    monkeypatch.setattr(llvm, "INLINED", inlined)
    native._kernel.cache_clear()
    compiled = compile_system(compose(MODEL, [Placement("coulomb", FRICTION, "load")]))
    size, columns = 2 * (1 + compiled.columns), compiled.columns
    rates, _ = map(as_function, compiled.kernel.with_sensitivities(columns))
    z, p = np.random.default_rng(1).normal(size=size), compiled.parameters
    # The input, the time until it changes, and the fastest rate of a memory.
    us, h = np.array([[u, 0.0, np.inf] for u in (0.3, 0.4, 0.5)]), 0.01

    def slope(t, at, u):
        out = np.zeros(size)
        rates(t, *addresses(at, u, p, out, out))
        return out

    k1 = slope(1.0, z, us[0])
    k2 = slope(1.005, z + 0.5 * h * k1, us[1])
    k3 = slope(1.005, z + 0.5 * h * k2, us[1])
    k4 = slope(1.01, z + h * k3, us[2])
    expected = z + (((h / 6 * k1 + h / 3 * k2) + h / 3 * k3) + h / 6 * k4)
    times = np.array([1.0, 1.005, 1.01, h])
    as_function(compiled.kernel.step(columns))(0.0, *addresses(z, us, p, times, times))
    np.testing.assert_array_equal(z, expected)


def test_initial_states_that_do_not_suit_the_windows_are_refused():
    compiled = compile_system(compose(MODEL))
    with pytest.raises(ModelError, match="found 6 initial values, expected 2 for each of 4"):
        compiled.linearise(
            np.zeros((80, 1)), 1 / 256, np.arange(4) * 20, 20, initial=np.zeros((3, 2)),
            parameters=compiled.parameters,
        )  # fmt: skip


def as_function(address):
    return CFUNCTYPE(None, c_double, *[c_void_p] * 5)(address)


def addresses(*arrays):
    return [array.ctypes.data for array in arrays]


def test_results_come_in_order_and_the_first_error_is_raised(monkeypatch):
    monkeypatch.setattr(turns, "cores", lambda: 3)
    assert side_by_side(lambda item: item**2, range(8)) == [item**2 for item in range(8)]

    def fails(item):
        if item in {3, 5}:
            raise ModelError(f"item {item}")

    with pytest.raises(ModelError, match="item 3"):
        side_by_side(fails, range(8))


def test_one_thread_runs_python_while_others_run_compiled_code(monkeypatch):
    monkeypatch.setattr(turns, "cores", lambda: 2)
    running, most, met = [], [], Barrier(2, timeout=60)

    def work(item):
        running.append(item)
        most.append(len(running))
        time.sleep(0.01)
        running.remove(item)
        with turns.turn_given():
            # Both get here only if neither keeps its turn.
            met.wait()
        return side_by_side(lambda inner: inner, [item, item])

    assert side_by_side(work, [1, 2]) == [[1, 1], [2, 2]]
    assert max(most) == 1


def test_systems_compiled_side_by_side_give_the_numbers_of_one_after_another(monkeypatch):
    names = ("coulomb", "stribeck", "dahl", "quadratic_drag", "cubic_stiffness", "backlash")
    effects = [library()[name].scaled({"x": 0.1, "v": 1.0}) for name in names]
    placed = [Placement(*each, "load") for each in zip(names, effects, strict=True)]

    def run(placement):
        compiled = compile_system(compose(MODEL, [placement]))
        inputs = np.random.default_rng(3).normal(size=(400, 1))
        return compiled.simulate(
            inputs, 1 / 256, np.arange(4) * 100, 100, parameters=compiled.parameters,
            initial=np.zeros((4, len(compiled.system.states))),
        )  # fmt: skip

    native._kernel.cache_clear()
    alone = [run(placement) for placement in placed]
    native._kernel.cache_clear()
    monkeypatch.setattr(turns, "cores", lambda: 4)
    for one, other in zip(side_by_side(run, placed), alone, strict=True):
        np.testing.assert_array_equal(one.outputs, other.outputs)
        np.testing.assert_array_equal(one.slopes, other.slopes)
