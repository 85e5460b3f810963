"""Converts a study's accepted friction to a model for the monitor.

For an inertia the study's own values are used: mass, constant force and friction. For a rig with a
transfer function, friction acts on the acceleration through the filter Ge, so its coefficients are
fitted through that filter on the training recordings. In both cases the monitor's residual on the
held-out recordings must fall; otherwise the model is refused.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from monitor.model import BandSection, InertiaPlant, PromotedSection, RigModel, model_text
from monitor.pipeline import RigMonitor
from monitor.signals import (
    ACCELERATION,
    G1,
    G2,
    GOOD,
    MODELLED,
    VELOCITY,
    VOLTAGE,
    Admission,
    TransferResidual,
)
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.session import open_session
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.data import find_period
from rigwatch.workbench.study import Span, Study, model_hash

TERMS = {
    "coulomb": ("Fc", "coulomb"),
    "viscous": ("d", "viscous"),
    "coulomb_by_direction": ("dF", "coulomb_by_direction"),
    "viscous_by_direction": ("dd", "viscous_by_direction"),
    "constant_force": ("F0", "offset"),
}
"""Effects that a monitor's model supports: the effect's parameter and the field for it."""
SMOOTH = 0.2
"""Width of the promoted friction's sign transition, as a share of the velocity's rms."""
BASES = {"emps-force": ("M", "Fv"), "emps": ("M", "Fv")}
"""Inertia models: names of their mass and of their own viscous friction."""


@dataclass(frozen=True)
class Promotion:
    """A model for the monitor.

    Attributes:
        model: the new model.
        text: the model file's text.
        before, after: the monitor's residual on the recordings held out, rms [m/s^2].
        learnt: promoted values, by name.
    """

    model: RigModel
    text: str
    before: float
    after: float
    learnt: dict[str, float]


def promotion(study: Study, model: RigModel) -> Promotion:
    """The monitor's model with the study's results.

    Raises:
        ModelError: the monitor's model does not support an effect, or the residual does not fall.
    """
    _check_effects(study)
    bare = structs.replace(model, promoted=None)
    if isinstance(model.plant, InertiaPlant):
        learnt = _of_study(study)
        new = _inertia(study, model, model.plant, learnt)
    else:
        new, learnt = _transfer(study, bare)
    before, after = (_residual(study, m) for m in (model, new))
    if not after < before:
        raise ModelError(
            f"{study.folder}: found a residual of {after:.4g} m/s^2 on the recordings held out with"
            f" the new model, expected less than the {before:.4g} m/s^2 without it"
        )
    return Promotion(new, model_text(new), before, after, learnt)


def _check_effects(study: Study) -> None:
    if not study.file.effects:
        raise ModelError(f"{study.folder}: found no accepted effect to promote")
    for accepted in study.file.effects:
        if accepted.effect not in TERMS or study.model.ports[accepted.port].kind != "force":
            raise ModelError(
                f"{accepted.effect}@{accepted.port}: not supported by a monitor's model, expected"
                f" one of {', '.join(TERMS)} at a force port"
            )


def _of_study(study: Study) -> dict[str, float]:
    """Mass, constant force and friction as fitted [SI units]."""
    if study.model.name not in BASES:
        raise ModelError(
            f"{study.model.name}: found a model that is not an inertia, expected one of"
            f" {', '.join(BASES)}, as the rig's model is an inertia"
        )
    found = open_bench(study).base.train.values()
    mass, viscous = BASES[study.model.name]
    learnt = {"mass": found[mass], "offset": 0.0, "viscous": found[viscous]}
    for accepted in study.file.effects:
        parameter, place = TERMS[accepted.effect]
        value = found[f"{accepted.port}_{accepted.effect}_{parameter}"]
        learnt[place] = learnt.get(place, 0.0) + value
    return learnt


def _inertia(
    study: Study, model: RigModel, plant: InertiaPlant, learnt: Mapping[str, float]
) -> RigModel:
    section = _section(study, learnt)
    old = model.promoted or PromotedSection()
    moved = section.coulomb - old.coulomb, section.viscous - old.viscous
    assert model.band is not None
    band = BandSection(
        low=(model.band.low[0] - moved[0], model.band.low[1] - moved[1]),
        high=(model.band.high[0] - moved[0], model.band.high[1] - moved[1]),
    )
    plant = structs.replace(plant, mass=learnt["mass"], offset=learnt["offset"])
    return structs.replace(model, plant=plant, band=band, promoted=section)


def _section(study: Study, learnt: Mapping[str, float]) -> PromotedSection:
    named = {name: learnt[name] for name in PromotedSection.__struct_fields__ if name in learnt}
    folder = study.folder.resolve().name
    return PromotedSection(study=folder, sha256=model_hash(study), **named)


def _transfer(study: Study, model: RigModel) -> tuple[RigModel, dict[str, float]]:
    """The rig's model with the accepted friction and the noise of the remaining residual."""
    whole = [_columns(study, span, model) for span in study.file.train]
    smooth = SMOOTH * _rms([columns[:, VELOCITY] for columns in whole])
    for columns in whole:
        columns[:, G1] = model.friction.function().simulate(np.tanh(columns[:, VELOCITY] / smooth))
    settled = [columns[model.decision.settle :] for columns in whole]
    learnt = _through_filter(study, np.concatenate(settled))
    section = structs.replace(_section(study, learnt), smooth=smooth)
    scatter = [_scatter(columns, section, model.sample_rate) for columns in settled]
    noise = structs.replace(model.noise, residual=max(model.noise.residual, *scatter))
    return structs.replace(model, promoted=section, noise=noise), learnt


def _through_filter(study: Study, columns: FloatArray) -> dict[str, float]:
    """Coefficients of the accepted friction in units of θ, by least squares on training data."""
    places = sorted({TERMS[a.effect][1] for a in study.file.effects})
    known = {"coulomb": G1, "viscous": G2}
    if strange := [place for place in places if place not in known]:
        raise ModelError(
            f"{study.folder}: found {', '.join(strange)}, expected only coulomb or viscous, as the"
            " rig's model is a transfer function"
        )
    regressors = columns[:, [known[place] for place in places]]
    wanted = columns[:, ACCELERATION] - columns[:, MODELLED]
    sizes, *_ = np.linalg.lstsq(regressors, wanted, rcond=None)
    return dict(zip(places, sizes.tolist(), strict=True))


def _scatter(columns: FloatArray, known: PromotedSection, sample_rate: float) -> float:
    """Period-to-period scatter of the residual, as white noise of equal effect: rms [m/s^2].

    Velocity noise is slow, so the friction error that it causes is autocorrelated over a window and
    disturbs the estimates more than white noise of the same rms. A few periods determine the
    scatter poorly, hence the margin of two standard errors. 0 if the drive is not periodic.
    """
    drive = Recording(1 / sample_rate, columns[:, [VOLTAGE]], columns[:, [ACCELERATION]])
    period = find_period(drive)
    if not period or len(columns) < 2 * period:
        return 0.0
    friction = known.coulomb * columns[:, G1] + known.viscous * columns[:, G2]
    residual = columns[:, ACCELERATION] - columns[:, MODELLED] - friction
    change = (residual[period:] - residual[:-period]) / np.sqrt(2)
    felt = [_equivalent_noise(change, columns[period:, g], period) for g in (G1, G2)]
    margin = 1 + 2 / np.sqrt(len(change) / period)
    return float(margin * max(np.std(change), *felt))


def _equivalent_noise(change: FloatArray, regressor: FloatArray, window: int) -> float:
    """Rms of white noise with the same influence on an estimate over a window."""
    along = np.convolve(change * regressor, np.ones(window), "valid")
    size = np.convolve(regressor**2, np.ones(window), "valid")
    return float(np.sqrt(np.mean(along**2 / size)))


def _columns(study: Study, span: Span, model: RigModel) -> FloatArray:
    """Columns of the residual stage at a recording's valid samples, shape (n, 7)."""
    needed = (model.channels[0], model.channels[2])
    admission = Admission(model.channels, needed, model.decision.longest_hold)
    stage, kept = TransferResidual(model), []
    for block in _blocks(study, span):
        admitted = admission.admit(block)
        if admitted is not None:
            columns = stage.update(admitted.signals, admitted.code)
            kept.append(columns[admitted.code == GOOD])
    return np.concatenate(kept)


def _residual(study: Study, model: RigModel) -> float:
    """The monitor's residual over the recordings held out, rms [m/s^2]."""
    parts: list[FloatArray] = []
    for span in study.file.held_out:
        monitor = RigMonitor(model)
        watched = [monitor.update(block) for block in _blocks(study, span)]
        found = [w.estimates.column("residual").values for w in watched if w is not None]
        parts += [np.concatenate(found)[model.decision.settle :]] if found else []
    return _rms(parts)


def _rms(parts: Sequence[FloatArray]) -> float:
    whole = np.concatenate(parts) if parts else np.zeros(0)
    whole = whole[np.isfinite(whole)]
    if not whole.size:
        raise ModelError("the monitor computes no valid residual on the held-out recordings")
    return float(np.sqrt(np.mean(whole**2)))


def _blocks(study: Study, span: Span) -> Iterator[SampleBlock]:
    session = open_session(study.folder / span.session)
    first = next(iter(session.samples())).t_ns[0]
    start = int(first + span.start * 1e9)
    end = int(first + span.end * 1e9) if np.isfinite(span.end) else None
    return session.samples(None, start, end)
