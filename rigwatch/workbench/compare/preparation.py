"""What every step of a study starts from: data prepared, model fitted, noise floor known.

Signals on one grid, how inputs are held, what the healthy recording tells (parameters, reference,
remainder), then the fit of the model with the effects accepted so far, and the error that noise
alone would leave.
"""

from dataclasses import dataclass, replace

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.horizon import with_horizon
from rigwatch.workbench.data import (
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
    commissioned,
    fit_base,
    fit_model,
    learns_from_healthy,
    loosely_told,
    referenced,
    with_healthy_remainder,
    with_hold,
)
from rigwatch.workbench.study import Study, check_data


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
    study = with_horizon(study)
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
    if study.kept is not None and data.healthy is not None:
        seconds = len(data.healthy) * data.healthy.dt
        loose = loosely_told(study.kept, study.model, seconds)
        data = replace(data, remarks=(*data.remarks, *loose))
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
        fits.append(fit_base(study, healthy, base.train.scale, afar=True))
    method = "healthy motion" if healthy.along_motion else "healthy"
    return NoiseFloor(min(fits, key=lambda fitted: fitted.train_error).held_out.rms, method)
