"""The same simulation by CasADi, by JAX and by SciPy's LSODA, each in its fastest form.

CasADi: one sample's Runge-Kutta steps as a function of states and sensitivities, accumulated over
the samples and mapped over the windows, in its virtual machine and as C. JAX: `jit` of `vmap` of
`jacfwd` of a scan, in double precision. LSODA: one solution a window and, for the sensitivities,
one more a column (forward differences).
"""

import contextlib
import shutil
import tempfile
from collections.abc import Callable, Sequence
from typing import Any

import casadi
import jax
import jax.numpy as jnp
import numpy as np
import sympy
from scipy.integrate import solve_ivp
from sympy.printing.numpy import NumPyPrinter

from benchmarks.simulation.simulation_task import Result, Simulator, Task
from rigwatch.physics.engine.compile.static_kernel import numpy_function
from rigwatch.wire.arrays import FloatArray

_CASADI = {
    "where": casadi.if_else, "maximum": casadi.fmax, "minimum": casadi.fmin,
    "logical_and": casadi.logic_and, "logical_or": casadi.logic_or, "abs": casadi.fabs,
    "sign": casadi.sign, "sqrt": casadi.sqrt, "tanh": casadi.tanh, "exp": casadi.exp,
    "log": casadi.log, "sin": casadi.sin, "cos": casadi.cos, "floor": casadi.floor,
}  # fmt: skip
RELATIVE_STEP = 1e-4
"""Of a parameter or initial state, for differences."""


class _Printer(NumPyPrinter):  # type: ignore[misc]
    """Functions without the names of modules in front."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False})


def in_casadi_compiled(task: Task) -> Simulator | None:
    """As C that CasADi prints and the system's compiler translates; None without a compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    flags = {"flags": ["-O3", "-march=native"], "cleanup": False}
    options = {"compiler": compiler, "linker": compiler, **flags}
    jit = {"jit": True, "jit_cleanup": False, "compiler": "shell", "jit_options": options}
    # CasADi writes its files to the working folder, and needs them until the code is loaded.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return in_casadi(task, jit)


def in_casadi(task: Task, options: dict[str, Any] | None = None) -> Simulator:
    """Runs in CasADi's virtual machine, unless the options say otherwise."""
    system = task.system
    n, m, nu = len(system.states), task.columns, task.inputs.shape[1]
    x, s = casadi.SX.sym("x", n), casadi.SX.sym("s", n, m)
    u, p, t = (casadi.SX.sym(*a) for a in (("u", nu), ("p", len(task.parameters)), ("t",)))
    rates, reads = (_symbolic(task, e, t, x, u, p) for e in (task.rates(), task.reads()))
    z = casadi.vertcat(x, casadi.vec(s))
    moving = casadi.Function("f", [t, z, u, p], [_with_slopes(task, rates, x, s, p)])
    reading = casadi.Function("g", [t, z, u, p], [_with_slopes(task, reads, x, s, p)])
    step = _sample_step(task, moving, z.numel(), options or {})
    along = step.mapaccum("along", task.length - 1)
    every = along.map(len(task.starts))
    read = reading.map(len(task.starts) * task.length)
    first = np.concatenate([task.initial.T, np.tile(_unit(task), (len(task.starts), 1)).T])
    rows = task.starts[:, None] + np.arange(task.length)
    now, then = task.inputs[rows[:, :-1].ravel()].T, task.inputs[rows[:, 1:].ravel()].T
    times, count = (rows * task.dt).ravel()[None], len(task.starts)
    steps = (rows[:, :-1] * task.dt).ravel()[None]
    given = np.tile(task.parameters[:, None], (1, steps.size))
    whole = np.tile(task.parameters[:, None], (1, times.size))

    def simulate() -> Result:
        moved = np.array(every(first, steps, now, then, given)).T.reshape(count, -1, len(first))
        path = np.concatenate([first.T[:, None], moved], axis=1).reshape(-1, len(first)).T
        found = np.array(read(times, path, task.inputs[rows.ravel()].T, whole)).T
        outputs = len(reads)
        y = found[:, :outputs].reshape(count, task.length, outputs)
        slopes = found[:, outputs:].reshape(count, task.length, m, outputs)
        return y, slopes.swapaxes(2, 3)

    return simulate


def _symbolic(  # noqa: PLR0917 -- the arguments of the equations
    task: Task, expressions: Sequence[sympy.Expr], t: Any, x: Any, u: Any, p: Any
) -> list[Any]:
    function = sympy.lambdify(
        task.names(), list(expressions), modules=[_CASADI], printer=_Printer()
    )
    arguments = [t, *casadi.vertsplit(x), *casadi.vertsplit(u), *casadi.vertsplit(p)]
    found: list[Any] = function(*arguments)
    return found


def _with_slopes(task: Task, expressions: list[Any], x: Any, s: Any, p: Any) -> Any:
    """Values, then J·S + ∂/∂p, column by column."""
    values = casadi.vertcat(*expressions)
    free, n = task.free(), len(task.system.states)
    explicit = casadi.jacobian(values, p)[:, free]
    still = casadi.SX.zeros(len(expressions), n)
    slopes = casadi.jacobian(values, x) @ s + casadi.horzcat(explicit, still)
    return casadi.vertcat(values, casadi.vec(slopes))


def _sample_step(task: Task, moving: Any, size: int, options: dict[str, Any]) -> Any:
    """From one sample to the next."""
    nu, h = task.inputs.shape[1], task.dt / task.substeps
    first, t, p = casadi.SX.sym("z", size), casadi.SX.sym("t"), len(task.parameters)
    now, then, given = (
        casadi.SX.sym("now", nu), casadi.SX.sym("then", nu), casadi.SX.sym("p", p)
    )  # fmt: skip
    z = first
    for step in range(task.substeps):

        def at(state: Any, share: float, step: int = step) -> Any:
            place = (step + share) / task.substeps
            return moving(t + place * task.dt, state, now + task.hold * place * (then - now), given)

        k1 = at(z, 0.0)
        k2 = at(z + h / 2 * k1, 0.5)
        k3 = at(z + h / 2 * k2, 0.5)
        z += h / 6 * (k1 + 2 * k2 + 2 * k3 + at(z + h * k3, 1.0))
    return casadi.Function("step", [first, t, now, then, given], [z], options)


def _unit(task: Task) -> FloatArray:
    """Sensitivities at the start of a window, column by column."""
    n, m = len(task.system.states), task.columns
    unit = np.zeros((n, m))
    unit[:, m - n :] = np.eye(n)
    return unit.T.ravel()


def in_jax(task: Task) -> Simulator:
    """Compiled by XLA for this processor."""
    jax.config.update("jax_enable_x64", True)
    rates, reads = (_in_jax(task, e) for e in (task.rates(), task.reads()))
    free, n = np.array(task.free(), dtype=np.int64), len(task.system.states)
    h, fixed = task.dt / task.substeps, jnp.asarray(task.parameters)

    def outputs(theta: Any, times: Any, inputs: Any) -> Any:
        p = fixed.at[free].set(theta[: len(free)])

        def sample(x: Any, given: Any) -> tuple[Any, Any]:
            t, now, then = given

            def at(state: Any, place: Any) -> Any:
                u = now + task.hold * place * (then - now)
                return rates(t + place * task.dt, state, u, p)

            def substep(step: Any, z: Any) -> Any:
                start, middle, end = (
                    (step + share) / task.substeps for share in (0.0, 0.5, 1.0)
                )  # fmt: skip
                k1 = at(z, start)
                k2 = at(z + h / 2 * k1, middle)
                k3 = at(z + h / 2 * k2, middle)
                return z + h / 6 * (k1 + 2 * k2 + 2 * k3 + at(z + h * k3, end))

            y = reads(t, x, now, p)
            moved = x
            for step in range(task.substeps):
                moved = substep(step, moved)
            return moved, y

        following = jnp.concatenate([inputs[1:], inputs[-1:]])
        return jax.lax.scan(sample, theta[len(free) :], (times, inputs, following))[1]

    def both(theta: Any, times: Any, inputs: Any) -> Any:
        return outputs(theta, times, inputs), jax.jacfwd(outputs)(theta, times, inputs)

    every = jax.jit(jax.vmap(both))
    rows = task.starts[:, None] + np.arange(task.length)
    given = np.tile(task.parameters[free], (len(task.starts), 1))
    theta = jnp.asarray(np.concatenate([given, task.initial], axis=1))
    arguments = (theta, jnp.asarray(rows * task.dt), jnp.asarray(task.inputs[rows]))
    assert n == task.initial.shape[1]

    def simulate() -> Result:
        y, slopes = every(*arguments)
        # Converting to NumPy waits until the arrays have been computed.
        return np.asarray(y), np.asarray(slopes)

    return simulate


def _in_jax(task: Task, expressions: Sequence[sympy.Expr]) -> Callable[..., Any]:
    function = sympy.lambdify(task.names(), list(expressions), modules="jax", cse=True)
    return lambda t, x, u, p: jnp.stack(
        [jnp.asarray(value, jnp.float64) for value in function(t, *x, *u, *p)]
    )


def in_scipy(task: Task) -> Simulator:
    """LSODA at a relative tolerance of 1e-8 with adaptive steps."""
    rates = sympy.lambdify(task.names(), task.rates(), modules="math", cse=True)
    reads = numpy_function([s.name for s in task.names()], task.reads())
    free = task.free()

    def outputs(window: int, p: FloatArray, x0: FloatArray) -> FloatArray:
        rows = task.starts[window] + np.arange(task.length)
        times = rows * task.dt

        def move(t: float, x: FloatArray) -> list[float]:
            row = min(int(t / task.dt + 1e-9), len(task.inputs) - 2)
            share = task.hold * (t / task.dt - row)
            u = task.inputs[row] + share * (task.inputs[row + 1] - task.inputs[row])
            return list(rates(t, *x.tolist(), *u.tolist(), *p.tolist()))

        found = solve_ivp(
            move, (times[0], times[-1]), x0, "LSODA", t_eval=times, rtol=1e-8,
            atol=1e-8 * scale, max_step=4 * task.dt,
        )  # fmt: skip
        return np.stack(
            np.broadcast_arrays(*reads(times, *found.y, *task.inputs[rows].T, *p)), axis=-1
        )

    scale = np.maximum(np.abs(task.initial).max(axis=0), 1e-3)

    def simulate() -> Result:
        y, slopes = [], []
        for window, x0 in enumerate(task.initial):
            base = outputs(window, task.parameters, x0)
            columns = []
            for column in range(task.columns):
                p, x = task.parameters.copy(), x0.copy()
                into, index = (
                    (p, free[column]) if column < len(free) else (x, column - len(free))
                )  # fmt: skip
                size = abs(into[index]) if into is p else float(scale[index])
                step = RELATIVE_STEP * max(size, 1e-6)
                into[index] += step
                columns.append((outputs(window, p, x) - base) / step)
            y.append(base)
            slopes.append(np.stack(columns, axis=-1))
        return np.stack(y), np.stack(slopes)

    return simulate
