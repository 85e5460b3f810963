"""Compares the model of a study with its recordings: errors, noise floor, parameters."""

from dataclasses import dataclass, field, replace

import numpy as np

from rigwatch.physics.engine.fit import Convergence
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.uncertainty_budget import beyond
from rigwatch.workbench.data import (
    METHODS,
    Data,
    NoiseFloor,
    along_motion,
    from_residual,
    goes_along_motion,
    prepare,
    quiet_scale,
)
from rigwatch.workbench.fit import (
    Fitted,
    Value,
    as_written,
    commissioned,
    fit_base,
    fit_model,
    free_run,
    learns_from_healthy,
    profile,
    referenced,
    values,
    with_healthy_remainder,
    with_hold,
)
from rigwatch.workbench.study import Held, Study, check_data


@dataclass(frozen=True)
class Channel:
    """Errors of one output, in its unit; the free run is one long simulation held out."""

    train_error: float
    held_out_error: float
    noise_floor: float
    unit: str
    free_run_error: float | None = None


@dataclass(frozen=True)
class Comparison:
    """How well the model does.

    Attributes:
        train_error, held_out_error, noise_floor: over all channels, in `unit`.
        unit: the channel's where there is one, else "noise floors".
        noise_from: how the floor is known.
        channels: by output.
        parameters: by name, in the units that the model and its effects are written in.
        effects: accepted so far, as "effect@port".
        remarks: what was noticed, for people.
        hold: what each input does between samples, by name.
        convergence: how the fit of the model ended.
    """

    train_error: float
    held_out_error: float
    noise_floor: float
    unit: str
    noise_from: str
    channels: dict[str, Channel]
    parameters: dict[str, Value]
    effects: list[str]
    remarks: list[str]
    hold: dict[str, Held] = field(default_factory=dict)
    convergence: Convergence | None = None


@dataclass(frozen=True, eq=False)
class Bench:
    """A study with its data and its model fitted: what every step starts from.

    Attributes:
        study, data: prepared.
        base: the model with the effects accepted so far.
        floor: of the held-out recordings' error.
        bare: the model alone, fitted to the healthy recording; None where there is none.
    """

    study: Study
    data: Data
    base: Fitted
    floor: NoiseFloor
    bare: Fitted | None


def open_bench(study: Study) -> Bench:
    """Read and fit a study.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    return bench_of(*prepared(study))


def prepared(study: Study) -> tuple[Study, Data, FloatArray | None]:
    """The study as its healthy recordings leave it, its data, and how channels are weighed.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    check_data(study)
    return told_by_healthy(study, prepare(study))


def told_by_healthy(study: Study, data: Data) -> tuple[Study, Data, FloatArray | None]:
    """The same of recordings that are in memory, for the study's model as it was written.

    Raises:
        ModelError: the model cannot be fitted to the healthy recording.
    """
    if learns_from_healthy(study):
        return *with_healthy_remainder(study, data), None
    if goes_along_motion(study):
        study, data = along_motion(study, data)
    several = data.train.outputs.shape[1] > 1 or data.along_motion
    scale = quiet_scale(data.train) if several else None
    study = with_hold(study, data, scale)
    study = commissioned(study, data, scale)
    return *referenced(study, data, scale), scale


def bench_of(study: Study, data: Data, scale: FloatArray | None = None) -> Bench:
    """The study's model fitted to its data, with the noise floor.

    Args:
        study, data: prepared.
        scale: divisor of each output's residuals, shape (outputs,); its spread if None.
    """
    study = with_hold(study, data, scale)
    base = fit_base(study, data, scale)
    healthy = data.of_healthy
    if healthy is None:
        floor = from_residual(base.held_out, data.held_out, study.file.period, data.horizon)
        return Bench(study, data, base, floor, None)
    bare = fit_model(study, healthy, (), study.file.start, base.train.scale, from_afar=True)
    return Bench(study, data, base, _of_healthy(study, healthy, base, bare), bare)


def _of_healthy(study: Study, healthy: Data, base: Fitted, bare: Fitted) -> NoiseFloor:
    """The floor from a healthy recording.

    There effects may be needed, or not even be able to vanish: a delay is not shorter than its
    bound. So the model counts with them or without, whichever does better.
    """
    fits = [bare]
    if base.placements:
        fits.append(fit_base(study, healthy, base.train.scale))
    method = "healthy motion" if healthy.along_motion else "healthy"
    return NoiseFloor(min(fits, key=lambda fitted: fitted.train_error).train.rms, method)


def compare(study: Study, *, profiled: bool = False) -> Comparison:
    """Errors, noise floor and parameters of the study's model as it is.

    Args:
        study: the study.
        profiled: intervals from the profile likelihood, which takes many fits.
    """
    bench = open_bench(study)
    found = comparison(bench)
    if not profiled:
        return found
    intervals = as_written(profile(bench.base, bench.data.train), bench.base.compiled.system)
    return replace(found, parameters=intervals)


def comparison(bench: Bench) -> Comparison:
    """The same of a bench that is open."""
    base, floor = bench.base, bench.floor
    outputs = bench.study.model.outputs
    channels = {
        name: Channel(float(a), float(b), float(c), output.unit, free)
        for (name, output), a, b, c, free in zip(
            outputs.items(), base.train.rms, base.held_out.rms, floor.rms, _free(bench), strict=True
        )
    }
    alone = len(channels) == 1
    total = floor.rms[0] if alone else np.sqrt(np.mean((floor.rms / base.train.scale) ** 2))
    found = values(base.train, beyond(bench.study, bench.data, bench.bare, base))
    weak = [f"{name}: {value.note}" for name, value in found.items() if value.note]
    return Comparison(
        base.train_error,
        base.held_out_error,
        float(total),
        next(iter(channels.values())).unit if alone else "noise floors",
        METHODS[floor.method],
        channels,
        as_written(found, base.compiled.system),
        [f"{a.effect}@{a.port}" for a in bench.study.file.effects],
        [*bench.data.remarks, *weak],
        dict(bench.study.holds),
        base.convergence or (bench.study.kept.convergence if bench.study.kept else None),
    )


def _free(bench: Bench) -> list[float | None]:
    """Errors of a free run; none without states, along the motion or of several recordings."""
    model, file = bench.study.model, bench.study.file
    if not model.states or bench.data.along_motion or len(file.held_out) > 1:
        return [None] * len(model.outputs)
    return [float(error) for error in free_run(bench.base, bench.data.held_out)]
