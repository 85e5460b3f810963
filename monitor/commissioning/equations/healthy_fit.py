"""Fits a model of equations to healthy recordings, driven along their measured motion.

Hidden states start near equilibrium, residuals are high-passed as in the monitor, and parameters
that the data do not determine stay near the model file's values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from monitor.observer import (
    SETTLING,
    SUBSTEPS,
    balanced,
    base_model,
    driven,
    friction_at,
    high_pass,
    rate_columns,
)
from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, System, compose
from rigwatch.physics.engine.fit import Recording, Thinning
from rigwatch.physics.engine.search import WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray

SPREAD, UNBOUND = 0.15, 2.0
"""Prior spread of parameters around the file's values: in the logarithm, as a share of the range
of their bounds, or a default without bounds; relative to the size for signed parameters.
"""
PULL = 0.1
"""Weight of the prior relative to the data: grows as this share of √n for n samples."""
EDGE = 0.5
"""Ends of a recording that are skipped while the high-pass settles [s]."""


@dataclass(frozen=True, eq=False)
class HealthyFit:
    """A fitted model.

    Attributes:
        names, values: parameters of the model.
        coulomb: dry friction of the healthy rig [N].
        rms: of the high-passed residual over all stretches.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    coulomb: float
    rms: float


def fit_healthy(
    name: str,
    port: str,
    stretches: Sequence[tuple[FloatArray, FloatArray]],
    *,
    turn: float,
    corner: float,
    rate: float,
    noise: float,
    known: Mapping[str, float],
) -> HealthyFit:
    """Parameters of the model named `name` from healthy recordings.

    Args:
        name: of a shipped model, or its file.
        port: where friction enters.
        stretches: inputs and motion, shape (n, inputs), and the output, shape (n, 1), smoothed.
        turn: speed over which dry friction changes sign.
        corner: of the high-pass [Hz].
        rate: sample rate [Hz].
        noise: of the measured output, rms.
        known: parameters already determined, which are fixed.
    """
    model = base_model(name)
    free = frozenset(n for n, p in model.parameters.items() if p.kept or not p.fixed)
    friction = friction_at(port, turn)[:1]
    system = compose(_balance(driven(model, free - set(known))), friction)
    judged = Thinning(1, round(EDGE * rate), (), high_pass(corner, rate))
    recordings = [Recording(1.0 / rate, rows, output, judged) for rows, output in stretches]
    compiled = compile_system(system)
    start = compiled.vector(dict(known))
    count = sum(len(each) - 2 * judged.edge for each in recordings)
    still = [_still(model, each.inputs[0], rate) for each in recordings]
    begun = [balanced(compiled, start, rows, 1.0 / rate) for rows in still]
    found, _ = multi_start_fit(
        WholeRuns(
            compiled, recordings, np.array([noise]), start=start,
            pull=PULL * np.sqrt(count) / _spreads(system), initial=np.array(begun),
            robust=np.inf, substeps=SUBSTEPS,
        )
    )  # fmt: skip
    values = found.values()
    strength = friction[0].prefix + str(friction[0].effect.strength)
    names = tuple(model.parameters)
    rms = float(found.rms[0])
    return HealthyFit(names, tuple(values[n] for n in names), max(values[strength], 0.0), rms)


def _balance(model: Model) -> Model:
    """The model with only its first output."""
    first = next(iter(model.outputs))
    ports = {n: p for n, p in model.ports.items() if p.kind != "sensor" or p.signal == first}
    return replace(model, outputs={first: model.outputs[first]}, ports=ports)


def _still(model: Model, row: FloatArray, rate: float) -> FloatArray:
    """Rows at rest over which hidden states reach equilibrium."""
    still = np.repeat(row[None, :], round(SETTLING * rate), axis=0)
    still[:, rate_columns(model)] = 0.0
    return still


def _spreads(system: System) -> FloatArray:
    """Prior spread of each free parameter around its value, shape (m,)."""
    found = []
    for name in system.free:
        p = system.parameters[name]
        bound = p.low > 0.0 and np.isfinite(p.high) and p.value > 0.0
        found.append(min(SPREAD * np.log(p.high / p.low), UNBOUND) if bound else UNBOUND)
    return np.array(found)
