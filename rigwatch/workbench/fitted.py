"""A model with some effects, fitted to the training recordings and judged on those held out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigwatch.physics.engine.compiled import CompiledSystem, FloatArray, compile_system
from rigwatch.physics.engine.fit import Fit, Recording, evaluate, fit, initial_states
from rigwatch.physics.engine.stability import accurate_substeps, stable_substeps
from rigwatch.physics.engine.system import Placement, System, compose
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.signals import Data, parameters_of
from rigwatch.workbench.sizes import port_sizes
from rigwatch.workbench.study import Study

LONG = 2000
"""Samples of a horizon from which a fit goes by way of a tenth of it."""
WELL_ABOVE = 1.5
"""Error over the channels' noise from which a fit may have stopped in a local minimum."""
BLOCKS = 40
"""Blocks that a recording of a model without states is cut into for statistics."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """One model, fitted and judged.

    Attributes:
        placements: its effects.
        train, held_out: the fit, and the same parameters on the other recordings.
        substeps: integration steps a sample.
        horizon: samples from one re-initialisation to the next.
    """

    placements: tuple[Placement, ...]
    train: Fit
    held_out: Fit
    substeps: int
    horizon: int

    @property
    def compiled(self) -> CompiledSystem:
        """The compiled system."""
        return self.train.compiled

    def errors(self, fitted: Fit) -> float:
        """One number for all channels: in the channel's unit where there is one, else scaled."""
        return overall(fitted)

    @property
    def train_error(self) -> float:
        """Overall error on the training recordings."""
        return overall(self.train)

    @property
    def held_out_error(self) -> float:
        """Overall error on the recordings held out."""
        return overall(self.held_out)


def overall(fitted: Fit) -> float:
    """Error over all channels: in the channel's unit where there is one, else in noise floors."""
    if len(fitted.scale) == 1:
        return float(fitted.rms[0])
    return float(np.sqrt(np.mean((fitted.rms / fitted.scale) ** 2)))


def block_errors(fitted: Fit) -> FloatArray:
    """Mean squared error of each block, shape (blocks,): windows, or pieces of a long recording."""
    scale = fitted.scale if len(fitted.scale) > 1 else 1.0
    squared = (fitted.residuals / scale) ** 2
    return np.array([np.nanmean(piece) for piece in blocks(squared) if np.isfinite(piece).any()])


def blocks(windowed: FloatArray) -> list[FloatArray]:
    """Windows (windows, samples, …) as blocks; few long windows are cut into pieces."""
    pieces = max(1, -(-BLOCKS // len(windowed)))
    cut = [np.array_split(window, min(pieces, len(window))) for window in windowed]
    return [piece for window in cut for piece in window]


def placements_of(study: Study, recording: Recording) -> tuple[Placement, ...]:
    """The accepted effects, with their bounds in sizes of the recording."""
    sizes = port_sizes(study.model, recording)
    return tuple(
        Placement(a.effect, study.effect(a.effect).scaled(sizes[a.port]), a.port)
        if a.port in sizes
        else Placement(a.effect, study.effect(a.effect), a.port)
        for a in study.file.effects
    )


def fit_base(study: Study, data: Data, scale: FloatArray | None = None) -> Fitted:
    """The model of a study with the effects accepted so far.

    Where that cannot be simulated from the study's own starting values, it is fitted effect by
    effect, as it was built.

    Raises:
        ModelError: it cannot be simulated that way either.
    """
    placements, start = placements_of(study, data.train), parameters_of(study.file)
    try:
        return fit_model(study, data, placements, start, scale)
    except ModelError:
        if not placements:
            raise
    found = fit_model(study, data, (), start, scale)
    for count in range(1, len(placements) + 1):
        found = fit_model(study, data, placements[:count], start | found.train.values(), scale)
    return found


def fit_model(
    study: Study,
    data: Data,
    placements: Sequence[Placement],
    start: Mapping[str, float],
    scale: FloatArray | None = None,
) -> Fitted:
    """The study's model with `placements`, fitted from `start`.

    Raises:
        ModelError: an effect does not fit its port, or the simulation leaves the finite numbers.
    """
    compiled = compile_system(compose(study.model, placements))
    horizon = data.horizon if study.model.states else len(data.train)
    begin = compiled.vector(start)
    substeps = max(study.file.substeps, _needed(compiled.system, data.train, begin))
    fit_over = partial(fit, compiled, data.train, scale=scale, substeps=substeps)
    if study.model.states and horizon >= LONG:
        # Over long horizons there are many local minima: start from where short ones lead.
        begin = fit_over(horizon // 10, start=begin).parameters
    found = fit_over(horizon, start=begin)
    if scale is not None and _noisy(found) and _last_is_stiff(study, data, placements, start):
        # What sticks and slips has many local minima too: try again by way of short horizons.
        near = fit_over(horizon // 8, start=begin)
        found = min(found, fit_over(horizon, start=near.parameters), key=_size)
    beside = data.horizon if study.model.states else len(data.held_out)
    judged = evaluate(found, data.held_out, beside, substeps=substeps)
    return Fitted(tuple(placements), found, judged, substeps, horizon)


def _last_is_stiff(
    study: Study, data: Data, placements: Sequence[Placement], start: Mapping[str, float]
) -> bool:
    """Whether the effect that came last asks for finer steps than the model."""
    system = compose(study.model, placements[-1:])
    values = {name: p.value for name, p in system.parameters.items()}
    at = np.array([start.get(name, value) for name, value in values.items()])
    return _needed(system, data.train, at) > study.file.substeps


def _size(fitted: Fit) -> float:
    return float(np.mean((fitted.rms / fitted.scale) ** 2))


def _noisy(fitted: Fit) -> bool:
    """Whether the residual is well above the noise that the channels are weighed by."""
    return _size(fitted) > WELL_ABOVE**2


def _needed(system: System, recording: Recording, parameters: FloatArray) -> int:
    """Substeps that follow friction, and keep memory stable wherever its parameters may go."""
    if not system.placements or not system.states:
        return 1
    states = initial_states(system, recording)
    fine = accurate_substeps(system, recording.inputs, states, parameters, recording.dt)
    memory = [name for name in system.states if name not in system.model.states]
    corners = []
    for bound in ("low", "high"):
        at = np.array([getattr(p, bound) for p in system.parameters.values()])
        corners.append(np.where(np.isfinite(at), at, parameters))
    stable = (
        stable_substeps(system, memory, recording.inputs, states, corner, recording.dt)
        for corner in corners
    )
    return max(fine, *stable)
