"""A free law at a port: any function of one variable there, fitted like an effect.

    F(z) = a₀ + a₁·z/s + a₂·tanh(z/w) + Σ aᵢ·max(z/s - kᵢ, 0)

with the rms s of the variable, knots kᵢ and w a hundredth of s. It contains every effect
without memory of that variable, more or less exactly, and has no physics. An effect that a free law
of its port beats by far is not the whole law there, and may stand in for another one. The parts
that the model already contains, for example a linear spring, are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.equations import Effect, EffectParameter, Placement
from rigwatch.physics.engine.score import Candidate, Scores
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, port_sizes
from rigwatch.workbench.fit import Fitted, fit_model
from rigwatch.workbench.ranking.scoring import score_all
from rigwatch.workbench.study import Study

NAME = "free_law"
KNOTS = (-1.5, -0.8, -0.3, 0.3, 0.8, 1.5)
"""Knots over the rms of the variable."""
NARROW = 0.01
"""Width of the step at zero over the rms of the variable."""
VARIABLES = {"force": ("x", "v"), "actuator": ("u",), "sensor": ("u",)}
"""Variables of which a law is tried, by kind of port."""


@dataclass(frozen=True, eq=False)
class FreeLaw:
    """A free law.

    Attributes:
        variable: of which it is a function.
        fitted: the model with it.
    """

    variable: str
    fitted: Fitted


def best_free_law(study: Study, data: Data, base: Fitted, port: str) -> FreeLaw | None:
    """The free law at a port, of the variable that promises most, in the model.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        port: its name.

    Returns:
        None if the port has no such variable, or the law cannot be fitted.
    """
    there = study.model.ports[port]
    names = [n for n in VARIABLES[there.kind] if n == "u" or n in there.variables]
    promising = [_promise(study, data, base, port, name) for name in names]
    best = max(promising, key=lambda each: each.explained, default=None)
    if best is None or best.explained == 0:
        return None
    # From no law at all: many parts at their first-order strengths would often diverge.
    begin = {best.placement.prefix + name: 0.0 for name in best.placement.effect.parameters}
    begin[best.placement.prefix + "s"] = best.placement.effect.parameters["s"].value
    start, placements = base.train.values() | begin, (*base.placements, best.placement)
    try:
        fitted = fit_model(study, data, placements, start, base.train.scale, base=base)
    except ModelError:
        return None
    return FreeLaw(best.variable, fitted)


@dataclass(frozen=True)
class _Promise:
    """A free law of one variable, to first order.

    Attributes:
        variable: its name.
        placement: the law at its port.
        explained: share of the residual's energy.
    """

    variable: str
    placement: Placement
    explained: float


def _promise(study: Study, data: Data, base: Fitted, port: str, name: str) -> _Promise:
    """The free law of a variable at a port, without parts that the model already contains."""
    z = f"{name}/s"
    parts = ["1.0", z, f"tanh({z}/{NARROW})", *(f"max({z} - {knot}, 0)" for knot in KNOTS)]
    laws = [_law(study, data, port, name, [part]) for part in parts]
    scores = score_all(data, base, [_candidate(law, port) for law in laws])
    seen = np.flatnonzero(_independent(scores.units)).tolist()
    whole = Placement(NAME, _law(study, data, port, name, [parts[k] for k in seen]), port)
    return _Promise(name, whole, _explained(scores, seen))


def _candidate(law: Effect, port: str) -> Candidate:
    return Candidate(NAME, law, port, {"s": law.parameters["s"].value})


def _independent(units: FloatArray) -> FloatArray:
    """Which directions add to those before them, shape (k,)."""
    left = np.linalg.qr(units).R
    return np.asarray(np.abs(np.diag(left)) > 1e-3)


def _explained(scores: Scores, parts: Sequence[int]) -> float:
    """Share of the residual's energy that parts explain together, to first order."""
    units = scores.units[:, parts]
    along = np.sign(scores.strength[parts]) * np.sqrt(scores.explained[parts])
    return float(along @ np.linalg.lstsq(units.T @ units, along, rcond=None)[0])


def _law(study: Study, data: Data, port: str, name: str, parts: Sequence[str]) -> Effect:
    """The law of a variable with these parts, as an effect scaled to the port."""
    force = study.model.ports[port].kind == "force"
    terms = [f"a{k}*({part})" for k, part in enumerate(parts)]
    strengths = {
        f"a{k}": EffectParameter(unit="{F}" if force else "{u}", role="shape" if k else "strength")
        for k in range(len(parts))
    }
    size = EffectParameter(unit=f"{{{name}}}", role="constant", value=1.0, scale=name)
    law = Effect(
        port="force" if force else "signal",
        expression=" + ".join(terms if force else ["u", *terms]),
        physics="Any function of one variable.",
        source="none",
        parameters={**strengths, "s": size},
    )
    known = replace(study, effects={**study.effects, NAME: law})
    return known.effect_at(NAME, port).scaled(port_sizes(study.model, data.train)[port])
