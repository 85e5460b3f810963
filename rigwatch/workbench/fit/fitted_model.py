"""A model with effects, fitted to the training recordings and judged on the held-out ones."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from rigwatch.physics.engine.compile import (
    INSTANT,
    CompiledSystem,
    compile_system,
    even_substeps,
    resolved,
)
from rigwatch.physics.engine.equations import Placement, System, compose
from rigwatch.physics.engine.fit import (
    Fit,
    Recording,
    evaluate,
    fit,
    initial_states,
    untied,
    windows,
    with_opening_values,
)
from rigwatch.physics.engine.search import (
    STARTS,
    Convergence,
    ShortHorizons,
    WholeRuns,
    at_other_values,
    begun_anew_nearby,
    continued_spread,
    convergence,
    fit_continued,
    fit_nearby,
    has_hidden_states,
    kept_promise,
    multi_start_fit,
)
from rigwatch.wire.arrays import ComplexArray, FloatArray, IntArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, parameters_of, port_sizes, quiet_scale
from rigwatch.workbench.fit.discontinuities import away_from_jumps
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.study import Study

LONG = 2000
"""Horizon in samples above which a fit starts with a shorter one."""
SHORTER = 8
"""Ratio of the horizon to the shorter one."""
WELL_ABOVE = 1.5
"""Ratio of error to noise above which a fit may have ended in a local minimum."""
MANY_PARAMETERS = 5
"""Number of free parameters above which a fit along the measured motion uses several starts."""
TO_THE_END = 30
"""Most simulations that fit the initial states of a held-out recording along the motion: a slow
state, as a sensor's mean, waits until pressures that soon do not matter have stopped moving."""
FAST, SLOWED = 1.0, 0.5
"""Eigenvalue times step above which a linearisation uses finer steps, and its value then."""
LOOKED_AT = 20
"""Largest number of windows whose eigenvalues are computed."""


def placements_of(study: Study, recording: Recording) -> tuple[Placement, ...]:
    """The accepted effects, with bounds scaled to the recording's signals."""
    sizes = port_sizes(study.model, recording)
    return tuple(
        Placement(
            a.effect,
            study.effect_at(a.effect, a.port).scaled(sizes[a.port]),
            a.port,
            a.ahead,
            a.beyond,
        )
        if a.port in sizes
        else Placement(a.effect, study.effect(a.effect), a.port, a.ahead, a.beyond)
        for a in study.file.effects
    )


def fit_base(
    study: Study, data: Data, scale: FloatArray | None = None, *, multi_start: bool = False
) -> Fitted:
    """Fit the model of a study with its accepted effects.

    The fit starts from the accepted fit of the last effect and stays in that minimum unless
    `multi_start` is set: another minimum may have a lower training error but was not the one
    accepted. If the model diverges from the study's initial values, it is fitted effect by effect
    in the order of acceptance.

    Raises:
        ModelError: the simulation diverges that way, too.
    """
    placements, start = placements_of(study, data.train), parameters_of(study.file)
    try:
        if not multi_start and keeps_accepted(study):
            found = fit_model(study, data, placements, start, scale)
            return with_convergence(found, data, "the accepted fit")
        return fit_with_retry(study, data, placements, start, scale, multi_start=True)
    except ModelError:
        if not placements:
            raise
    own = {name: value for name, value in start.items() if name in study.model.parameters}
    found = fit_model(study, data, (), own, scale, multi_start=True)
    for count in range(1, len(placements) + 1):
        waiting = {p.prefix + name for p in placements[count:] for name in p.effect.parameters}
        begin = {name: value for name, value in start.items() if name not in waiting}
        begin |= found.train.values()
        found = fit_with_retry(study, data, placements[:count], begin, scale, multi_start=True)
    return found


def keeps_accepted(study: Study) -> bool:
    """Whether a study has the fit with which its last effect was accepted."""
    return bool(study.file.effects and study.file.effects[-1].model)


def with_convergence(found: Fitted, data: Data, begun: str) -> Fitted:
    """A fit from a single start with its convergence; `begun` is that start, in words."""
    gradient = None
    if not data.along_motion:
        gradient = kept_promise(found.train, data.train, found.horizon, found.substeps)
    ended = convergence(found.train, [], begun, near_noise=False, gradient=gradient)
    return replace(found, convergence=ended)


def fit_with_retry(
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    start: Mapping[str, float],
    scale: FloatArray | None = None,
    *,
    base: Fitted | None = None,
    multi_start: bool = False,
) -> Fitted:
    """`fit_model`, repeated if it may have ended in a local minimum."""
    found = fit_model(study, data, placements, start, scale, base=base, multi_start=multi_start)
    if scale is None or not may_be_local_minimum(study, data, found, start):
        return found
    return refit_from_short_horizons(study, data, found, start)


def refit_from_short_horizons(
    study: Study, data: Data, found: Fitted, start: Mapping[str, float]
) -> Fitted:
    """The better of a fit and a second one that starts with short horizons."""
    try:
        again = fit_model(
            study, data, found.placements, start, found.train.scale, base=found,
            from_short_horizons=True,
        )  # fmt: skip
    except ModelError:
        return found
    best = min(found, again, key=lambda fitted: _size(fitted.train))
    return replace(best, convergence=_ended_again(found, again, best))


def _ended_again(found: Fitted, again: Fitted, best: Fitted) -> Convergence | None:
    """Convergence of the better of two fits; None if neither was checked."""
    if best is found or found.convergence is None:
        return found.convergence
    return convergence(again.train, [found.train], "short horizons", near_noise=False)


def fit_model(
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    start: Mapping[str, float],
    scale: FloatArray | None = None,
    *,
    base: Fitted | None = None,
    from_short_horizons: bool = False,
    multi_start: bool = False,
) -> Fitted:
    """Fit the study's model with `placements` from `start`.

    Args:
        study, data: the study and its recordings.
        placements: effects in the model.
        start: initial values by name; the model's own for those not given.
        scale: divisor of each output's residuals, shape (outputs,).
        base: a fit with fewer effects, whose initial states are used as start.
        from_short_horizons: start from a fit over short horizons, since stick-slip has many local
            minima over long ones.
        multi_start: whether `start` may be far from the optimum, so that other starts are tried.

    Raises:
        ModelError: an effect does not fit its port, or the simulation diverged (NaN or infinite).
    """
    found, ended, horizon = _trained(
        study, data, placements, start, scale, base, from_short_horizons, multi_start
    )
    initial = base.held_out.initial if base else None
    return _judged(study, data, placements, found, horizon, initial, ended)


def trained(
    study: Study,
    data: Data,
    placements: tuple[Placement, ...],
    start: Mapping[str, float],
    base: Fitted,
) -> Fitted:
    """`fit_model` without a judgement: held out is what it was fitted to.

    Args:
        study, data, placements, start: as in `fit_model`.
        base: a fit with the same effects or fewer.

    Raises:
        ModelError: an effect does not fit its port, or the simulation diverged (NaN or infinite).
    """
    found, _, horizon = _trained(study, data, placements, start, base.train.scale, base)
    return Fitted(placements, found, found, study.file.substeps, horizon)


def values_with(
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    start: Mapping[str, float],
    scale: FloatArray,
) -> dict[str, float]:
    """The parameters that `fit_model` finds, by name, without a judgement by held-out recordings.

    Raises:
        ModelError: an effect does not fit its port, or the simulation diverged (NaN or infinite).
    """
    found, _, _ = _trained(study, data, placements, start, scale)
    return with_opening_values(
        found, study.model, data.openings, data.horizon, study.file.substeps
    ).values()


def _trained(  # noqa: PLR0917 -- the arguments of `fit_model`
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    start: Mapping[str, float],
    scale: FloatArray | None,
    base: Fitted | None = None,
    from_short_horizons: bool = False,
    multi_start: bool = False,
) -> tuple[Fit, Convergence | None, int]:
    """The fit to the training recordings, its convergence, and the horizon of its windows."""
    compiled = _compiled(study, placements, start, data.train.dt)
    horizon = data.horizon if study.model.states else len(data.train)
    begin, substeps = compiled.vector(start), study.file.substeps
    first = base.train.initial if base else None
    fit_over = partial(fit, compiled, data.train, scale=scale, substeps=substeps)
    last_fit = fit_over
    if _may_continue(study, data):
        last_fit = partial(fit_continued, compiled, data.train, scale=scale, substeps=substeps)
    search: ShortHorizons | WholeRuns | None = None
    if data.along_motion and len(compiled.system.free) >= MANY_PARAMETERS and scale is not None:
        search = WholeRuns(
            compiled, _in_windows(data.train, horizon), scale, start=begin, substeps=substeps,
            thorough=True, starts=STARTS if study.model.presence is None else 0,
        )  # fmt: skip
    elif multi_start and not data.along_motion:
        noise = quiet_scale(data.train) if scale is None else scale
        search = ShortHorizons(
            compiled, data.train, horizon, begin, scale, noise, first, substeps,
            continued=not study.model.rough,
        )  # fmt: skip
    if search:
        best, ended = multi_start_fit(search)
        found = _settled(study, data, best, horizon, substeps)
        if found is not best:
            return found, at_other_values(ended, found), horizon
        return begun_anew_nearby(best, data.train, horizon, substeps), ended, horizon
    over_all = partial(last_fit, horizon, initial=first)
    found = _of_free_run(study, data, fit_over, over_all, begin, from_short_horizons)
    return _settled(study, data, found, horizon, substeps), None, horizon


def _of_free_run(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    fit_over: Callable[..., Fit],
    over_all: Callable[..., Fit],
    begin: FloatArray,
    from_short_horizons: bool,
) -> Fit:
    """The fit, begun over short horizons where it is long, asked for, or runs away otherwise.

    A spring that softens, begun too soft, lets the motion run away within a window. Over a part of
    it its size is found.
    """
    free_run = study.model.states and not data.along_motion

    def begun_short() -> Fit:
        shorter = max(data.horizon // SHORTER, 1)
        return over_all(start=fit_over(shorter, start=begin).parameters)

    if free_run and (data.horizon >= LONG or from_short_horizons):
        return begun_short()
    try:
        return over_all(start=begin)
    except ModelError:
        if free_run:
            with suppress(ModelError):
                return begun_short()
        raise


def _in_windows(recording: Recording, horizon: int) -> list[Recording]:
    """A recording in parts of one horizon each; itself if it is no longer."""
    if len(recording) <= horizon:
        return [recording]
    ends = range(horizon, len(recording) + 1, horizon)
    return [recording.stretch(end - horizon, end) for end in ends]


def _compiled(
    study: Study, placements: Sequence[Placement], start: Mapping[str, float], spacing: float
) -> CompiledSystem:
    """The model with its effects, bounded to modes that the recording resolves."""
    compiled = compile_system(compose(study.model, placements))
    return replace(compiled, system=resolved(compiled.system, compiled.vector(start), spacing))


def _may_continue(study: Study, data: Data) -> bool:
    """Whether hidden states may continue from window to window.

    Along the motion they follow it, and those of a rough model have its reference.
    """
    return not (data.along_motion or study.model.rough)


def _settled(study: Study, data: Data, found: Fit, horizon: int, substeps: int) -> Fit:
    """The fit with undetermined parameter combinations resolved, before it is judged.

    Along the motion, priors resolve them; the learned terms of a rough model are inherently tied.
    """
    if not _may_continue(study, data):
        return found
    system = found.compiled.system
    centre = {name: p.value for name, p in system.parameters.items()}
    for placement in system.placements:
        strength = placement.effect.strength
        centre[placement.prefix + strength] = placement.effect.parameters[strength].neutral
    fitted_to = data.train, horizon, substeps
    untied_fit = untied(
        found,
        centre,
        lambda at, prior: fit_nearby(at, prior, *fitted_to),
        (lambda at: _continued_error(at, *fitted_to)) if has_hidden_states(system) else None,
    )
    return found if untied_fit is found else begun_anew_nearby(untied_fit, *fitted_to)


def _continued_error(found: Fit, recording: Recording, horizon: int, substeps: int) -> float:
    """Error with hidden states continued; infinite if they diverge."""
    try:
        return continued_spread(found, recording, horizon, substeps)
    except ModelError:
        return math.inf


def _judged(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    found: Fit,
    horizon: int,
    initial: FloatArray | None,
    ended: Convergence | None,
) -> Fitted:
    """A fit with its held-out error."""
    # Of a training that is shared with a healthy recording the windows are its parts.
    windowed = study.model.states and study.model.presence is None
    length = data.horizon if windowed else len(data.held_out)
    substeps = study.file.substeps
    found = with_opening_values(found, study.model, data.openings, data.horizon, substeps)
    judging = _may_continue(study, data)
    further = {"steps": TO_THE_END} if data.along_motion else {}
    judged = evaluate(found, data.held_out, length, substeps, initial, judging=judging, **further)
    _check_counted(judged)
    calm = away_from_jumps(found, data.held_out, length)
    return Fitted(tuple(placements), found, judged, substeps, horizon, calm, ended)


def _check_counted(judged: Fit) -> None:
    """Raises a `ModelError` unless a sample of each output counts on the recordings held out."""
    counted = np.isfinite(judged.residuals).any(axis=(0, 1))
    if not counted.all():
        name = list(judged.compiled.system.outputs)[int(np.argmin(counted))]
        raise ModelError(
            f"found no sample of {name} that counts on a recording that judges the model, expected"
            " some: those from which its first states are found do not count, nor, along the"
            " measured motion, those near standstill"
        )


def may_be_local_minimum(
    study: Study, data: Data, found: Fitted, start: Mapping[str, float]
) -> bool:
    """Whether a fit may have ended in a local minimum.

    True if its residual exceeds the noise and its last effect needs finer steps than the model.
    """
    if not found.placements or _size(found.train) <= WELL_ABOVE**2:
        return False
    system = compose(study.model, found.placements[-1:])
    values = {name: p.value for name, p in system.parameters.items()}
    at = np.array([start.get(name, value) for name, value in values.items()])
    return _even(system, data.train, at) > study.file.substeps


def _size(fitted: Fit) -> float:
    return float(np.mean((fitted.rms / fitted.scale) ** 2))


def _even(system: System, recording: Recording, parameters: FloatArray) -> int:
    states = initial_states(system, recording)
    return even_substeps(system, recording.inputs, states, parameters, recording.dt)


def nodes(fitted: Fitted, recording: Recording) -> int:
    """Integration steps per sample of a linearisation, equal for all samples."""
    system = fitted.compiled.system
    if not system.states:
        return 1
    even = max(fitted.substeps, _even(system, recording, fitted.train.parameters))
    fastest = _fastest(fitted, recording) * recording.dt
    if fastest <= FAST * even:
        return even
    # Of a mode that is instantaneous for the recording only the decay matters.
    return math.ceil(max(min(fastest, INSTANT) / SLOWED, fastest / FAST))


def _fastest(fitted: Fitted, recording: Recording) -> float:
    """Largest eigenvalue of the model at the start of its windows [1/s]."""
    return float(np.abs(eigenvalues(fitted, recording)).max(initial=0.0))


def eigenvalues(fitted: Fitted, recording: Recording) -> ComplexArray:
    """Eigenvalues of the model at the start of its windows [1/s], shape (windows, states)."""
    starts = windows(fitted.compiled.system, len(recording), fitted.horizon).starts[:LOOKED_AT]
    # Without states of its own a model has an initial state for each recording, and one window.
    initial = fitted.train.initial[: len(starts)]
    return _eigenvalues(
        fitted.compiled, recording, starts,
        initial=initial, parameters=fitted.train.parameters, substeps=fitted.substeps,
    )  # fmt: skip


def given_eigenvalues(study: Study, recording: Recording) -> ComplexArray:
    """The same at moments all over the recording, of the model as it is given.

    States have there what channels show, others their starting value.
    """
    start = parameters_of(study.file)
    compiled = _compiled(study, placements_of(study, recording), start, recording.dt)
    every = max(len(recording) // LOOKED_AT, 2)
    starts = np.arange(0, len(recording) - 1, every, dtype=np.int64)[:LOOKED_AT]
    return _eigenvalues(
        compiled, recording, starts,
        initial=initial_states(compiled.system, recording)[starts],
        parameters=compiled.vector(start), substeps=study.file.substeps,
    )  # fmt: skip


def _eigenvalues(
    compiled: CompiledSystem,
    recording: Recording,
    starts: IntArray,
    *,
    initial: FloatArray,
    parameters: FloatArray,
    substeps: int,
) -> ComplexArray:
    run = compiled.linearise(
        recording.inputs, recording.spacing, starts, 2,
        initial=initial, parameters=parameters,
        substeps=substeps, begins=recording.begins, time=recording.time,
    )  # fmt: skip
    free, n = len(compiled.system.free), run.states.shape[2]
    slopes = run.rate_slopes[:, 0, :, free : free + n]
    finite = slopes[np.isfinite(slopes).all(axis=(1, 2))]
    return np.asarray(np.linalg.eigvals(finite), np.complex128)
