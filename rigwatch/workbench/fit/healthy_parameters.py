"""Kept parameters: fitted to a healthy recording once and fixed afterwards.

The seal of a healthy cylinder leaks a little and its piston has some drag. If these parameters were
refitted to every new recording, they would absorb the fault. They are therefore fitted to the
healthy recording and then fixed. Without a healthy recording, parameters that are fixed in the
model keep their values, and the others are fitted to each recording.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, Parameter, compose
from rigwatch.physics.engine.fit import evaluate
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data, quiet_scale, repeat_along_motion
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.fit.intervals import covariance
from rigwatch.workbench.study import Kept, Study

SAME = 1e-6
"""Singular value, relative to the largest, below which a direction counts as undetermined."""
POORLY_DETERMINED = 0.3
"""Relative standard deviation of a kept parameter above which a remark is given."""
HOPELESS = 10.0
"""Relative standard deviation above which it makes no difference how large it is."""
NEAR_ZERO = 0.01
"""Share of its range used as a lower limit of a parameter's value in relative deviations."""
LONGEST = 600.0
"""Longest healthy recording that a remark asks for [s]."""


def with_healthy_parameters(study: Study, data: Data, scale: FloatArray | None = None) -> Study:
    """The study with a model whose kept parameters come from the healthy recording.

    Args:
        study: as opened.
        data: its recordings.
        scale: divisor of each output's residuals, shape (outputs,).

    Raises:
        ModelError: the model cannot be fitted to the healthy recording.
    """
    healthy = data.of_healthy
    kept = [name for name, p in study.model.parameters.items() if p.kept]
    if healthy is None or not kept:
        return study
    loose = replace(study, model=with_kept_free(study.model))
    # The parameters depend on nothing but the healthy recording.
    own = quiet_scale(healthy.train) if healthy.along_motion else scale
    found = fit_model(loose, healthy, (), study.file.start, own, multi_start=True)
    places = [found.compiled.system.free.index(name) for name in kept]
    repeat = repeat_along_motion(healthy)
    uncertain = covariance(found.train, repeat)[0][np.ix_(places, places)]
    fitted = Kept(tuple(kept), uncertain, found.convergence)
    # Every later fit begins with the values under [start], and these are settled now.
    start = {name: value for name, value in study.file.start.items() if name not in kept}
    return replace(
        study,
        file=structs.replace(study.file, start=start),
        model=with_values(study.model, found.train.values()),
        kept=with_known(fitted, healthy, found),
    )


def with_known(kept: Kept, healthy: Data, found: Fitted) -> Kept:
    """The kept parameters extended by known ones with a stated deviation.

    If a known parameter m is wrong by d, the others fitted to the healthy recording shift by

        κ ← κ - H_κ⁺·H_m·d,   H: derivatives of the residual there

    Args:
        kept: parameters from the healthy recording.
        healthy: that recording.
        found: the model's fit to it.
    """
    model, own = found.compiled.system.model, found.compiled.system.free
    known = [n for n, p in model.parameters.items() if p.deviation and n not in own]
    if not known:
        return kept
    compiled = compile_system(compose(with_kept_free(model, known)))
    parameters = compiled.vector(found.train.values())
    loose = replace(found.train, compiled=compiled, parameters=parameters)
    at = evaluate(loose, healthy.train, found.horizon, found.substeps, found.train.initial)
    slopes = at.jacobian.reshape(-1, at.jacobian.shape[-1])
    by_own, by_known = (
        slopes[:, [compiled.system.free.index(n) for n in names]] for names in (own, known)
    )
    size = np.maximum(np.linalg.norm(by_own, axis=0), 1e-300)
    turn = -np.linalg.lstsq(by_own / size, by_known, rcond=SAME)[0] / size[:, None]
    moves = np.vstack([turn[[own.index(n) for n in kept.names]], np.eye(len(known))])
    deviations = np.array([model.parameters[n].deviation for n in known])
    whole = (moves * deviations**2) @ moves.T
    count = len(kept.names)
    whole[:count, :count] += kept.covariance
    return replace(kept, names=(*kept.names, *known), covariance=whole)


def poorly_determined(kept: Kept, model: Model, seconds: float) -> tuple[str, ...]:
    """Remarks on kept parameters that the healthy recording determines poorly.

    Args:
        kept: parameters from the healthy recording.
        model: the model with their values.
        seconds: length of the recording less the settling time of hidden states [s].
    """
    deviations = np.sqrt(np.diag(kept.covariance))
    shares = {
        name: float(deviation) / _scale_of(model.parameters[name])
        for name, deviation in zip(kept.names, deviations, strict=True)
        if model.parameters[name].kept
    }
    loose = {name: share for name, share in shares.items() if share > POORLY_DETERMINED}
    if not loose:
        return ()
    listed = ", ".join(
        f"{name} ({model.parameters[name].meaning or 'a parameter'}) to {_told(share)}"
        for name, share in loose.items()
    )
    needed = seconds * (max(loose.values()) / POORLY_DETERMINED) ** 2
    longer = f"{needed:.2g} s of such a motion" if needed < LONGEST else "another motion"
    return (
        f"the healthy recording of {seconds:.3g} s determines {listed} of its value only; {longer}"
        f" would determine them to {POORLY_DETERMINED:.0%}",
    )


def _told(share: float) -> str:
    """A relative deviation in percent, of which a parameter that nothing determines has no end."""
    return f"{share:.0%}" if share < HOPELESS else f"more than {HOPELESS:.0%}"


def _scale_of(p: Parameter) -> float:
    """Reference of a relative deviation: the value, or a hundredth of the range if near 0."""
    span = p.high - p.low
    return max(abs(p.value), NEAR_ZERO * span if np.isfinite(span) else 0.0, 1e-300)


def with_kept_free(model: Model, names: Collection[str] = ()) -> Model:
    """The model with its kept parameters and those named set free."""
    return with_free(model, {*names, *(name for name, p in model.parameters.items() if p.kept)})


def with_free(model: Model, names: Collection[str]) -> Model:
    """The model with the parameters named set free."""
    free = {
        name: structs.replace(p, fixed=p.fixed and name not in names)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=free)


def with_values(model: Model, values: Mapping[str, float]) -> Model:
    """The model with these values, and its kept parameters fixed at them."""
    changed = {
        name: structs.replace(p, value=values[name], fixed=p.fixed or p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=changed)
