"""Starting point of every step of a study: prepared data, fitted model, noise floor.

In order: signals on one time grid, holds of the inputs, results from the healthy recording
(parameters, reference, remainder), fit of the model with the accepted effects, noise floor.
"""

from dataclasses import dataclass, replace

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.beside_healthy import may_share, shared, was_accepted_so
from rigwatch.workbench.compare.horizon import with_horizon
from rigwatch.workbench.compare.row_order import with_row_order
from rigwatch.workbench.data import (
    Data,
    NoiseFloor,
    along_motion,
    expected_error,
    held_out_floor,
    learns_from_healthy,
    overstated,
    predicts_along_motion,
    prepare,
    quiet_scale,
    with_elements,
)
from rigwatch.workbench.fit import (
    Fitted,
    begun_from_given,
    fit_base,
    fit_model,
    keeps_accepted,
    only_noise_left,
    poorly_determined,
    with_healthy_parameters,
    with_healthy_reference,
    with_healthy_remainder,
    with_hold,
)
from rigwatch.workbench.study import Study, check_data


@dataclass(frozen=True, eq=False)
class Bench:
    """A study with its data and its fitted model, from which every step starts.

    Attributes:
        study, data: prepared.
        base: the model with the accepted effects, fitted.
        floor: noise floor of the held-out recordings.
        bare: the model alone, fitted to the healthy recording; None if there is none.
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
    """The study with the results of its healthy recordings, its data, and the channels' weights.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    check_data(study)
    study = with_horizon(study)
    study, data = with_row_order(study, prepare(study))
    if study.file.noise:
        remarks = overstated(study, quiet_scale(data.held_out))
        data = replace(data, remarks=(*data.remarks, *remarks))
    return determined_by_healthy(study, data)


def determined_by_healthy(study: Study, data: Data) -> tuple[Study, Data, FloatArray | None]:
    """`prepared` for recordings in memory, for the study's unmodified model.

    Raises:
        ModelError: the model cannot be fitted to the healthy recording.
    """
    study = with_elements(study, data.healthy or data.train)
    if learns_from_healthy(study):
        return *with_healthy_remainder(study, data), None
    if predicts_along_motion(study):
        study, data = along_motion(study, data)
    several = data.train.outputs.shape[1] > 1 or data.along_motion
    scale = quiet_scale(data.train) if several else None
    study = with_hold(study, data, scale)
    study = with_healthy_parameters(study, data, scale)
    if study.kept is not None and data.healthy is not None:
        seconds = len(data.healthy) * data.healthy.dt
        loose = poorly_determined(study.kept, study.model, seconds)
        data = replace(data, remarks=(*data.remarks, *loose))
    return *with_healthy_reference(study, data, scale), scale


def bench_of(study: Study, data: Data, scale: FloatArray | None = None) -> Bench:
    """The study's model fitted to its data, with the noise floor.

    Args:
        study, data: prepared.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
    """
    study = with_hold(study, data, scale)
    base = fit_base(study, data, scale)
    healthy = data.of_healthy
    if healthy is None:
        floor, bare = held_out_floor(study, data, base.train, base.held_out), None
    else:
        bare = fit_model(study, healthy, (), study.file.start, base.train.scale, multi_start=True)
        floor = _of_healthy(study, data, healthy, base, bare)
    bench = Bench(study, data, base, floor, bare)
    if was_accepted_so(study) and may_share(study, data):
        return beside_healthy(bench)
    # An accepted fit was begun where the model without its effect had ended.
    if keeps_accepted(study) and not only_noise_left(floor, base):
        return with_base(bench, begun_from_given(study, data, base))
    return bench


def beside_healthy(bench: Bench) -> Bench:
    """The bench with the healthy recording in its training, see `beside_healthy.py`.

    Args:
        bench: of a study that `may_share`.

    Raises:
        ModelError: the model cannot be fitted.
    """
    study, data = shared(bench.study, bench.data)
    healthy, scale = data.of_healthy, bench.base.train.scale
    assert healthy is not None
    base = fit_base(study, data, scale)
    bare = fit_model(study, healthy, (), {}, scale, multi_start=True)
    return Bench(study, data, base, bench.floor, bare)


def with_base(bench: Bench, base: Fitted) -> Bench:
    """The bench with another fit of its model, and the noise floor that follows from it."""
    if base is bench.base:
        return bench
    floor = bench.floor
    if bench.data.of_healthy is None:
        floor = held_out_floor(bench.study, bench.data, base.train, base.held_out)
    return replace(bench, base=base, floor=floor)


def _of_healthy(study: Study, data: Data, healthy: Data, base: Fitted, bare: Fitted) -> NoiseFloor:
    """The noise floor from a healthy recording.

    An accepted effect may be part of the healthy rig, or unable to vanish (a delay has a lower
    bound). The floor is therefore the smaller error of the model with and without the effects.
    """
    fits = [bare]
    if base.placements:
        fits.append(fit_base(study, healthy, base.train.scale, multi_start=True))
    held_out = min(fits, key=lambda fitted: fitted.train_error).held_out
    if not healthy.along_motion:
        return NoiseFloor(held_out.rms, "healthy")
    thinning = healthy.held_out.thinning
    own = expected_error(
        held_out.residuals, healthy.held_out.outputs, data.held_out.outputs,
        thinning.factor if thinning else 1,
    )  # fmt: skip
    return NoiseFloor(held_out.rms, "healthy motion", own_error=own)
