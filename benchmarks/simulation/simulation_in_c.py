"""The same simulation in C: SymPy's C printer, `cc -O3 -march=native`, constant sizes."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sympy

from benchmarks.simulation.simulation_task import Result, Simulator, Task
from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.equations.scope import symbol

FLAGS = ("-O3", "-march=native")
_DRIVER = """
#define SIZE (N * (1 + M))

static void place(const double *u, long row, double share, double *us) {
    for (int j = 0; j < NU; j++)
        us[j] = u[row * NU + j] + share * (u[(row + 1) * NU + j] - u[row * NU + j]);
}

static void rates(double t, const double *z, const double *u, const double *p, double *dz) {
    equations(t, z, u, p, z + N, dz, dz + N);
}

void simulate(const double *u, double dt, long substeps, double hold, const long *starts,
              long windows, long length, const double *x0, const double *p, double *y, double *dy) {
    double z[SIZE], zs[SIZE], dz[SIZE], acc[SIZE], us[NU], h = dt / substeps;
    for (long w = 0; w < windows; w++) {
        for (int i = 0; i < SIZE; i++) z[i] = 0.0;
        for (int i = 0; i < N; i++) {
            z[i] = x0[w * N + i];
            z[N + i * M + M - N + i] = 1.0;
        }
        for (long k = 0; k < length; k++) {
            long row = starts[w] + k, at = w * length + k;
            reading(row * dt, z, u + row * NU, p, z + N, y + at * NY, dy + at * NY * M);
            for (long step = 0; k + 1 < length && step < substeps; step++) {
                double start = (double)step / substeps, middle = (step + 0.5) / substeps;
                double end = (step + 1.0) / substeps;
                place(u, row, hold * start, us);
                rates((row + start) * dt, z, us, p, dz);
                for (int i = 0; i < SIZE; i++) {
                    acc[i] = h / 6.0 * dz[i];
                    zs[i] = z[i] + 0.5 * h * dz[i];
                }
                place(u, row, hold * middle, us);
                rates((row + middle) * dt, zs, us, p, dz);
                for (int i = 0; i < SIZE; i++) {
                    acc[i] += h / 3.0 * dz[i];
                    zs[i] = z[i] + 0.5 * h * dz[i];
                }
                rates((row + middle) * dt, zs, us, p, dz);
                for (int i = 0; i < SIZE; i++) {
                    acc[i] += h / 3.0 * dz[i];
                    zs[i] = z[i] + h * dz[i];
                }
                place(u, row, hold * end, us);
                rates((row + end) * dt, zs, us, p, dz);
                for (int i = 0; i < SIZE; i++) z[i] += acc[i] + h / 6.0 * dz[i];
            }
        }
    }
}
"""


def in_c(task: Task) -> Simulator | None:
    """The simulator; None without a compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp())
    (folder / "kernel.c").write_text(_source(task), encoding="utf-8")
    subprocess.run(
        [compiler, *FLAGS, "-shared", "-fPIC", "kernel.c", "-o", "kernel.so", "-lm"],
        cwd=folder,
        check=True,
    )
    function = ctypes.CDLL(str(folder / "kernel.so")).simulate
    shutil.rmtree(folder)
    floats, integers = np.ctypeslib.ndpointer(np.float64), np.ctypeslib.ndpointer(np.int64)
    long, double = ctypes.c_long, ctypes.c_double
    function.argtypes = [
        floats, double, long, double, integers, long, long, floats, floats, floats, floats
    ]  # fmt: skip
    function.restype = None

    def simulate() -> Result:
        y = np.empty((len(task.starts), task.length, len(task.system.outputs)))
        dy = np.empty((*y.shape, task.columns))
        function(
            task.inputs, task.dt, task.substeps, task.hold, task.starts, len(task.starts),
            task.length, task.initial, task.parameters, y, dy,
        )  # fmt: skip
        return y, dy

    return simulate


def _source(task: Task) -> str:
    sizes = {
        "N": len(task.system.states),
        "M": task.columns,
        "NU": task.inputs.shape[1],
        "NY": len(task.system.outputs),
    }
    return "\n".join([
        "#include <math.h>",
        *(f"#define {name} {size}" for name, size in sizes.items()),
        *_function(task, "equations", task.rates()),
        *_function(task, "reading", task.reads()),
        _DRIVER,
    ])  # fmt: skip


def _function(task: Task, name: str, expressions: list[sympy.Expr]) -> Iterator[str]:
    """Values in f, and J·S + ∂/∂p in df, rows of M."""
    system = task.system
    by = [symbol(each) for each in (*system.states, *system.free)]
    slopes = [[derivative(e, s) for s in by] for e in expressions]
    flat = [*expressions, *(e for row in slopes for e in row)]
    shared, reduced = sympy.cse(flat, symbols=sympy.numbered_symbols("cse_"), order="none")
    n, rest = len(system.states), iter(reduced)
    yield f"static inline void {name}(double t, const double *x_, const double *u_,"
    yield "    const double *p_, const double *s_, double *f_, double *df_) {"
    for array, names in (("x_", system.states), ("u_", system.model.inputs),
                         ("p_", system.parameters)):  # fmt: skip
        yield from (f"    const double {each} = {array}[{i}];" for i, each in enumerate(names))
    for each, expression in shared:
        yield f"    const double {each} = {sympy.ccode(expression)};"
    yield from (f"    f_[{i}] = {sympy.ccode(next(rest))};" for i in range(len(expressions)))
    for i, row in enumerate(slopes):
        texts = [(column, entry, sympy.ccode(next(rest))) for column, entry in enumerate(row)]
        terms = [f"({text}) * s_[{c} * M + k_]" for c, entry, text in texts[:n] if entry != 0]
        total = " + ".join(terms) or "0.0"
        yield f"    for (int k_ = 0; k_ < M; k_++) df_[{i} * M + k_] = {total};"
        for column, entry, text in texts[n:]:
            if entry != 0:
                yield f"    df_[{i} * M + {column - n}] += {text};"
    yield "}"
