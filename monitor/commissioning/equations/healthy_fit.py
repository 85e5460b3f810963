"""Fits a model of equations to healthy recordings, driven along their measured motion.

Hidden states start near equilibrium, residuals are high-passed as in the monitor, and parameters
that the data do not determine stay near the model file's values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from monitor.commissioning.equations.described import rms
from monitor.observer import (
    SETTLING,
    SUBSTEPS,
    balanced,
    driven,
    friction_at,
    high_pass,
    rate_columns,
)
from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, System, compose
from rigwatch.physics.engine.fit import Fit, Recording, Thinning, beginning, evaluate
from rigwatch.physics.engine.search import WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

SPREAD, UNBOUND = 0.15, 2.0
"""Prior spread of parameters around the file's values: in the logarithm, as a share of the range
of their bounds, or a default without bounds; relative to the size for signed parameters.
"""
PULL = 0.1
"""Weight of the prior relative to the data: grows as this share of √n for n samples."""
EDGE = 0.5
"""Ends of a recording that are skipped while the high-pass settles [s]."""


@dataclass(frozen=True, eq=False)
class Stretches:
    """Healthy recordings, their fitted parts, and all that is known beforehand.

    Attributes:
        port: where friction enters.
        parts: inputs and motion, shape (n, inputs), and the output, shape (n, 1), of each
            recording.
        fitted: samples of each that are fitted; those that follow judge.
        turn: speed over which dry friction changes sign.
        corner: of the high-pass [Hz].
        rate: sample rate [Hz].
        noise: of the measured output, rms.
        known: parameters already determined, which are fixed.
    """

    port: str
    parts: Sequence[tuple[FloatArray, FloatArray]]
    fitted: Sequence[int]
    turn: float
    corner: float
    rate: float
    noise: float
    known: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class HealthyFit:
    """A fitted model.

    Attributes:
        model: that was fitted.
        values: its parameters, by name.
        coulomb: dry friction of the healthy rig [N].
        error: rms of the high-passed residual over the fitted parts, in that of the sensor's noise.
        later: the same over what follows them; infinite if the model diverges there, NaN if
            nothing follows.
    """

    model: Model
    values: Mapping[str, float]
    coulomb: float
    error: float
    later: float


def fit_healthy(
    model: Model, data: Stretches, start: Mapping[str, float] | None = None, *, brief: bool = False
) -> HealthyFit:
    """Parameters of a model from healthy recordings.

    Args:
        model: of equations.
        data: the recordings.
        start: initial values of its parameters; its own for those not given.
        brief: whether one short search from there is enough.

    Raises:
        ModelError: the simulation along the motion diverges.
    """
    free = frozenset(n for n, p in model.parameters.items() if p.kept or not p.fixed)
    friction = friction_at(data.port, data.turn)[:1]
    system = compose(_balance(driven(model, free - set(data.known))), friction)
    judged = Thinning(1, round(EDGE * data.rate), (), high_pass(data.corner, data.rate))
    recordings = [Recording(1.0 / data.rate, rows, output, judged) for rows, output in data.parts]
    parts = [beginning(one, n) for one, n in zip(recordings, data.fitted, strict=True)]
    compiled = compile_system(system)
    begin = compiled.vector({**(start or {}), **data.known})
    count = sum(len(each) - 2 * judged.edge for each in parts)
    still = [_still(model, each.inputs[0], data.rate) for each in parts]
    begun = np.array([balanced(compiled, begin, rows, 1.0 / data.rate) for rows in still])
    found, _ = multi_start_fit(
        WholeRuns(
            compiled, parts, np.array([data.noise]), start=begin,
            pull=PULL * np.sqrt(count) / _spreads(system), initial=begun,
            robust=np.inf, substeps=SUBSTEPS, brief=brief,
        )
    )  # fmt: skip
    values = found.values()
    strength = friction[0].prefix + str(friction[0].effect.strength)
    later = [_left_later(found, *each) for each in zip(recordings, data.fitted, begun, strict=True)]
    return HealthyFit(
        model,
        {name: values[name] for name in model.parameters},
        max(values[strength], 0.0),
        float(found.rms[0]) / data.noise,
        rms(np.concatenate(later)) / data.noise if any(map(len, later)) else np.nan,
    )


def _left_later(found: Fit, recording: Recording, fitted: int, begun: FloatArray) -> FloatArray:
    """The high-passed residual of what follows the fitted part; infinite if it diverges."""
    if recording.thinning is None or len(recording) <= fitted + 2 * recording.thinning.edge:
        return np.zeros(0)
    try:
        whole = evaluate(found, recording, len(recording), SUBSTEPS, begun[None, :])
    except ModelError:
        return np.array([np.inf])
    return whole.residuals[0, fitted - recording.thinning.edge :, 0]


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
