"""Simulation with exact sensitivities: rigwatch, the same in C, CasADi, JAX and SciPy.

All solve the same problem: 20 windows of 256 samples (20 s at 256 Hz), each from its own initial
state, four classical Runge-Kutta steps a sample with inputs on straight lines between samples, and
the derivatives of all outputs by all free parameters and initial states. SciPy's LSODA
uses adaptive steps and finite differences, as it has no derivatives.

    python -m benchmarks simulation_speed
"""

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.simulation.simulation_in_c import in_c
from benchmarks.simulation.simulation_rivals import (
    in_casadi,
    in_casadi_compiled,
    in_jax,
    in_scipy,
)
from benchmarks.simulation.simulation_task import Result, Simulator, Task
from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, System, compose
from rigwatch.wire.arrays import FloatArray
from tools.benchmark_table import Row

LENGTH = 256
BAR = 1.5
"""Time of rigwatch over that of C."""
EQUAL = 1e-9
"""Largest difference of outputs and sensitivities, over the largest of their channel."""
EQUAL_ADAPTIVE = 1e-4
"""The same for outputs alone, with adaptive steps."""


def oscillator(windows: int) -> Task:
    """A mass-spring-damper with smooth Coulomb friction and cubic stiffness."""
    effects = library()
    sizes = {"x": 0.1, "v": 10.0}
    placed = [
        Placement(name, effects[name].scaled(sizes), "load")
        for name in ("coulomb", "cubic_stiffness")
    ]
    system = compose(shipped_models()["mass-spring-damper"], placed)
    values = {
        "m": 0.8, "c": 1.5, "k": 60.0, "load_coulomb_Fc": 0.5, "load_cubic_stiffness_k3": 800.0,
    }  # fmt: skip
    return _task("mass-spring-damper, Coulomb, cubic", system, values, 4.0, windows)


def pneumatic(windows: int) -> Task:
    """The rig's servo-pneumatic actuator as it is shipped."""
    system = compose(shipped_models()["servo-pneumatic"])
    return _task("servo-pneumatic", system, {}, 0.5, windows)


def _task(name: str, system: System, values: dict[str, float], size: float, windows: int) -> Task:
    """20 s of excitation from 0.25 to 8 Hz; windows start from states of a run from rest."""
    compiled, rng = compile_system(system), np.random.default_rng(1)
    n, dt = LENGTH * 20, 1 / 256
    lines = np.arange(0.25, 8, 0.25)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(np.arange(n) * dt, lines) + phases).sum(axis=1)
    inputs = np.ascontiguousarray((size * waves / np.sqrt(len(lines) / 2))[:, None])
    parameters = compiled.vector(values)
    rest = np.array([[state.start for state in system.states.values()]])
    path = compiled.linearise(
        inputs, dt, np.zeros(1, np.int64), n, initial=rest, parameters=parameters, substeps=4
    ).states[0, ::4]
    starts = np.arange(windows) * LENGTH
    return Task(name, system, inputs, dt, starts, LENGTH, path[starts].copy(), parameters)


def ours(task: Task) -> Simulator:
    """The simulation of rigwatch."""
    compiled = compile_system(task.system)

    def simulate() -> Result:
        run = compiled.simulate(
            task.inputs, task.dt, task.starts, task.length, initial=task.initial,
            parameters=task.parameters, substeps=task.substeps, finest=1,
        )  # fmt: skip
        return run.outputs, run.slopes

    return simulate


def timed(simulators: dict[str, Simulator], repeats: int) -> dict[str, float]:
    """Median seconds of each, in turns, so that other load affects all of them."""
    taken: dict[str, list[float]] = {name: [] for name in simulators}
    for _ in range(repeats):
        for name, simulate in simulators.items():
            begin = time.perf_counter()
            simulate()
            taken[name].append(time.perf_counter() - begin)
    return {name: statistics.median(seconds) for name, seconds in taken.items()}


def difference(found: Sequence[FloatArray], expected: Sequence[FloatArray]) -> float:
    """Largest difference, over the largest value of the same output and column."""
    worst = 0.0
    for one, other in zip(found, expected, strict=True):
        size = np.abs(other).max(axis=(0, 1))
        apart = np.abs(one - other).max(axis=(0, 1))
        worst = max(worst, float((apart / np.where(size > 0, size, 1.0)).max()))
    return worst


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    windows, repeats = (4, 3) if quick else (20, 21)
    return [row for make in (oscillator, pneumatic) for row in _rows(make(windows), repeats)]


def _rows(task: Task, repeats: int) -> Iterator[Row]:
    begin = time.perf_counter()
    mine = ours(task)
    expected = mine()
    ready = {"ours": time.perf_counter() - begin}
    fast: dict[str, Simulator] = {"ours": mine}
    for name, make in (
        ("C", in_c),
        ("CasADi", in_casadi),
        ("CasADi through C", in_casadi_compiled),
        ("JAX", in_jax),
    ):
        begin = time.perf_counter()
        if (simulate := make(task)) is None:
            yield Row(f"{task.name}: {name}", "no compiler here", "", "", "", None)
            continue
        fast[name] = simulate
        simulate()
        ready[name] = time.perf_counter() - begin
    seconds = timed(fast, repeats)
    yield _own(task, seconds, ready["ours"])
    for name in list(fast)[1:]:
        apart = difference(fast[name](), expected)
        yield _rival(task, name, seconds, f"ready in {ready[name]:.2f} s", apart, EQUAL)
    # LSODA takes seconds, so only one window is timed.
    few = replace(task, starts=task.starts[1:2], initial=task.initial[1:2])
    slow = in_scipy(few)
    begin = time.perf_counter()
    found = slow()
    taken = (time.perf_counter() - begin) * len(task.starts)
    few_expected = ours(few)()
    apart = difference(found[:1], few_expected[:1])
    slopes = difference(found[1:], few_expected[1:])
    note = (
        "one window, times their number; relative tolerance 1e-8, forward differences, whose"
        f" sensitivities differ by {slopes:.0e}"
    )
    yield _rival(task, "SciPy LSODA", seconds | {"SciPy LSODA": taken}, note, apart, EQUAL_ADAPTIVE)


def _own(task: Task, seconds: dict[str, float], ready: float) -> Row:
    shape = f"{len(task.system.states)} states, {task.columns} columns, {len(task.starts)} windows"
    note = f"{shape}; ready in {ready:.2f} s with the loops compiled before"
    measured = f"{seconds['ours'] * 1e3:.1f} ms"
    if "C" not in seconds:
        return Row(f"{task.name}: ours", measured, "", "", note, None)
    ratio = seconds["ours"] / seconds["C"]
    return Row(
        f"{task.name}: ours", f"{measured}, {ratio:.2f} × C", f"≤ {BAR:g} × C", "", note,
        ratio <= BAR,
    )  # fmt: skip


def _rival(  # noqa: PLR0917 -- they make one row
    task: Task, name: str, seconds: dict[str, float], note: str, apart: float, equal: float
) -> Row:
    measured = f"{seconds[name] * 1e3:.1f} ms, {seconds[name] / seconds['ours']:.2f} × ours"
    same = f"differs from ours by {apart:.0e} of the largest, expected {equal:.0e} at most"
    return Row(f"{task.name}: {name}", measured, "", "", f"{note}; {same}",
               None if apart <= equal else False)  # fmt: skip
