"""A study: one readable file, `study.toml`, a ledger of every step, and nothing hidden.

The file names a model, recordings to fit and recordings held out, and lists the effects that have
been accepted, one `[[effects]]` table each at its end. Adding an effect writes a table there,
undoing takes the last one away; the rest of the file, with its comments, stays as it was written.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, field, structs
from numpy.typing import NDArray

from rigwatch.physics.engine.equations import (
    Effect,
    EffectParameter,
    Hold,
    Model,
    Parameter,
    check_model,
    library,
    model_named,
    offered,
    units_at,
    with_variants,
)
from rigwatch.physics.engine.search import Convergence
from rigwatch.wire.errors import ConfigError, ModelError, RigwatchError, nearest
from rigwatch.wire.typed_files import Section, load, parse, read_text
from rigwatch.wire.units import Unit, unit_of
from rigwatch.workbench.study.folder import FILE, LEDGER, settle
from rigwatch.workbench.study.recording_parameters import known_as_inputs, known_in_si

GIVEN = ("the study", "the model file")
"""Sources of holds that nothing was chosen for."""

Lateness = Annotated[float, Meta(ge=0, le=1)]


class Span(Section, frozen=True, kw_only=True):
    """A recording, or a part of one."""

    session: Annotated[str, Meta(description="session file, from the study's folder")]
    start: Annotated[float, Meta(ge=0, description="seconds into it where the part begins")] = 0.0
    end: Annotated[float, Meta(description="seconds into it where the part ends")] = float("inf")
    parameters: Annotated[
        dict[str, float],
        Meta(description="the model's parameters that are known of this recording, in their units"),
    ] = field(default_factory=dict)


class Derived(Section, frozen=True, kw_only=True):
    """A signal that is made from a channel: low-passed and differentiated."""

    channel: Annotated[str, Meta(description="channel it is made from")]
    order: Annotated[int, Meta(ge=0, le=2, description="how often it is differentiated")] = 0


class Derive(Section, frozen=True, kw_only=True):
    """How signals are made from channels."""

    low_pass: Annotated[float, Meta(gt=0, description="zero-phase Butterworth of order 4 [Hz]")]
    signals: Annotated[dict[str, Derived], Meta(description="the signals, by name")]


class Thin(Section, frozen=True, kw_only=True):
    """Residuals are low-passed and thinned before they are counted."""

    factor: Annotated[int, Meta(ge=1, description="samples for one that stays")] = 1
    edge: Annotated[int, Meta(ge=0, description="samples left out at both ends, after it")] = 0


class Accepted(Section, frozen=True, kw_only=True):
    """An effect that has been added."""

    effect: Annotated[str, Meta(description="its name")]
    port: Annotated[str, Meta(description="where it enters")]
    parameters: Annotated[
        dict[str, float], Meta(description="where its fit starts, in the units that are shown")
    ] = field(default_factory=dict)
    model: Annotated[
        dict[str, float],
        Meta(description="where the rest of the model starts: the fit that it was accepted with"),
    ] = field(default_factory=dict)


class StudyFile(Section, frozen=True, kw_only=True):
    """The file `study.toml`."""

    model: Annotated[str, Meta(description="a shipped model's name, or a model file")]
    variants: Annotated[
        tuple[str, ...], Meta(description="variants of the model, see `rigwatch study base`")
    ] = ()
    train: Annotated[tuple[Span, ...], Meta(min_length=1, description="what is fitted to")]
    held_out: Annotated[tuple[Span, ...], Meta(min_length=1, description="what decides")]
    healthy: Annotated[
        tuple[Span, ...], Meta(description="recordings with nothing wrong, for the noise floor")
    ] = ()
    horizon: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(
            description="time between re-initialisations [s]; chosen from the data and the model's"
            " time constants if not given"
        ),
    ] = None
    prediction: Annotated[
        Literal["auto", "measured motion", "free"],
        Meta(
            description="along the measured motion, or free runs over horizons; auto: along the"
            " motion where channels show some of the model's states but not all"
        ),
    ] = "auto"
    rate: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(description="rate that all recordings are put on [Hz]; their own if not given"),
    ] = None
    substeps: Annotated[int, Meta(ge=1, description="integration steps a sample")] = 2
    period: Annotated[float, Meta(ge=0, description="period of the excitation [s], 0: look")] = 0.0
    channels: Annotated[
        dict[str, str], Meta(description="channel of a model's signal, where named otherwise")
    ] = field(default_factory=dict)
    start: Annotated[
        dict[str, float],
        Meta(description="values of the model's parameters to start from, in their units"),
    ] = field(default_factory=dict)
    hold: Annotated[
        dict[str, Hold],
        Meta(description="what inputs do between samples; the data choose where nothing says"),
    ] = field(default_factory=dict)
    late: Annotated[
        dict[str, Lateness],
        Meta(description="shares of a sample by which inputs that are kept are late"),
    ] = field(default_factory=dict)
    derive: Derive | None = None
    thin: Thin | None = None
    effect_files: Annotated[
        tuple[str, ...], Meta(description="own effects, TOML files from the study's folder")
    ] = ()
    whole_library: Annotated[
        bool, Meta(description="rank the elective effects of the library as well")
    ] = False
    effects: Annotated[tuple[Accepted, ...], Meta(description="accepted so far, in order")] = ()


@dataclass(frozen=True, eq=False)
class Kept:
    """Parameters that the healthy recording told.

    Attributes:
        names: of the model's parameters.
        covariance: of their values, shape (names, names).
        convergence: how the fit ended that told them; None where it was not asked.
    """

    names: tuple[str, ...]
    covariance: NDArray[np.float64]
    convergence: Convergence | None = None


@dataclass(frozen=True)
class Held:
    """What an input does between samples, and how that is known.

    Attributes:
        hold: "linear" for a line, "zero" where it is kept.
        late: share of a sample by which it changes late, where it is kept.
        seconds: the same [s]; 0 where the time between samples is not known yet.
        source: who says so.
        error_ratio: error with it over that with a line, None where nothing was compared.
    """

    hold: Hold
    late: float
    seconds: float
    source: str
    error_ratio: float | None = None


@dataclass(frozen=True)
class Study:
    """A study that has been opened; values of parameters are SI, whatever its file says.

    Attributes:
        folder: where it is.
        file: what its file says.
        model: the base model.
        effects: every effect that may be tried: shipped, from entry points, own; by name.
        own: names of those that are not shipped.
        kept: what the healthy recording told, None before it was asked.
        holds: what inputs do between samples, by name, where that is known.
        text: what its file said when it was opened.
        horizon_from: what the horizon was chosen from, in words; empty where it is given.
    """

    folder: Path
    file: StudyFile
    model: Model
    effects: Mapping[str, Effect]
    own: frozenset[str]
    kept: Kept | None = None
    holds: Mapping[str, Held] = dataclass_field(default_factory=dict)
    text: str = ""
    horizon_from: str = ""

    @property
    def ledger(self) -> Path:
        """The ledger's file."""
        return self.folder / LEDGER

    def sessions(self) -> dict[str, Path]:
        """The recordings, by the name that the file gives them."""
        spans = (*self.file.train, *self.file.held_out, *self.file.healthy)
        return {span.session: self.folder / span.session for span in spans}

    def with_effects(self, effects: Sequence[Accepted]) -> "Study":
        """The same with these effects in its model, in memory alone."""
        return replace(self, file=structs.replace(self.file, effects=tuple(effects)))

    def effect(self, name: str) -> Effect:
        """The effect called `name`.

        Raises:
            ModelError: there is none; near matches are named.
        """
        if name not in self.effects:
            raise ModelError(f"found no effect {name!r}{nearest(name, self.effects)}")
        return self.effects[name]

    def effect_at(self, name: str, port: str) -> Effect:
        """The effect called `name` with the units of a port, its numbers in SI.

        Raises:
            ModelError: it is unknown, or the port does not offer what its units name.
        """
        effect = self.effect(name)
        if port not in self.model.ports:
            return effect
        return effect.at(units_at(self.model, port), f"effect {name} at {port}")


def open_study(folder: Path | str) -> Study:
    """The study in `folder`.

    Raises:
        ConfigError: there is none, or its file does not fit.
        ModelError: its model or one of its effects is unknown.
    """
    folder = Path(folder)
    path = folder / FILE
    settle(folder)
    if not path.is_file():
        raise ConfigError(path, "", "no such file", "a study; make one with `rigwatch study new`")
    return study_of(folder, read_text(path))


def study_of(folder: Path, text: str) -> Study:
    """The study that `folder` would hold if its file said `text`; nothing is written.

    Raises:
        ConfigError: the text does not fit.
        ModelError: its model or one of its effects is unknown.
    """
    file = parse(text, StudyFile, folder / FILE)
    given = offered(folder / name for name in file.effect_files)
    effects = {**library(), **given}
    written = _written(folder, file)
    file = known_in_si(written, file, folder / FILE)
    model, holds = _held(known_as_inputs(written, file), file)
    study = Study(folder, file, model, effects, frozenset(given), holds=holds, text=text)
    for accepted in file.effects:
        study.effect(accepted.effect)
    return _in_si(study)


def _in_si(study: Study) -> Study:
    """The study with the values of its file in SI; there they stand in the parameters' units."""
    start = {
        name: _unit(study.model.parameters.get(name)).to_si(value)
        for name, value in study.file.start.items()
    }
    effects = [converted(study, a, "to_si") for a in study.file.effects]
    return replace(study, file=structs.replace(study.file, start=start, effects=tuple(effects)))


def converted(study: Study, accepted: Accepted, way: Literal["to_si", "from_si"]) -> Accepted:
    """The values of an accepted effect, from the units that people write to SI or back."""
    known = study.effect_at(accepted.effect, accepted.port).parameters
    values = {
        name: float(getattr(_unit(known.get(name)), way)(value))
        for name, value in accepted.parameters.items()
    }
    rest = {
        name: float(getattr(_unit(_named(study, name)), way)(value))
        for name, value in accepted.model.items()
    }
    return structs.replace(accepted, parameters=values, model=rest)


def _named(study: Study, name: str) -> Parameter | EffectParameter | None:
    """The parameter that a system calls `name`: the model's, or one of an accepted effect."""
    for accepted in study.file.effects:
        prefix = f"{accepted.port}_{accepted.effect}_"
        own = study.effect_at(accepted.effect, accepted.port).parameters
        if name.startswith(prefix) and name[len(prefix) :] in own:
            return own[name[len(prefix) :]]
    return study.model.parameters.get(name)


def _unit(parameter: Parameter | EffectParameter | None) -> Unit:
    """The unit in which people write a parameter's values."""
    return unit_of((parameter.shown or parameter.unit) if parameter else "")


def _written(folder: Path, file: StudyFile) -> Model:
    """The study's model with its variants, as its file describes it."""
    model = model_named(file.model, folder)
    if file.model.endswith(".toml"):
        check_model(model, str(folder / file.model))
    return with_variants(model, file.variants)


def varied(study: Study, variants: Sequence[str]) -> Study:
    """The study with these variants of its model, in memory alone.

    Raises:
        ModelError: a variant is unknown, or two of them exclude each other.
    """
    file = structs.replace(study.file, variants=tuple(variants))
    model, holds = _held(known_as_inputs(_written(study.folder, file), file), file)
    return replace(study, file=file, model=model, kept=None, holds=holds)


def _held(model: Model, file: StudyFile) -> tuple[Model, dict[str, Held]]:
    """The model with the holds that the study gives it, and all that are given.

    Raises:
        ModelError: the study names an input that the model does not have.
    """
    for name in (*file.hold, *file.late):
        if name not in model.inputs:
            raise ModelError(f"hold: found input {name!r}{nearest(name, model.inputs)}")
    inputs, holds = {}, {}
    for name, own in model.inputs.items():
        hold, late = file.hold.get(name), file.late.get(name)
        if late is not None:
            hold = hold or "zero"
        source = "the study" if hold else "the model file"
        hold = hold or own.hold or model.hold
        late = own.late if late is None else late
        inputs[name] = structs.replace(own, hold=hold, late=late)
        if hold:
            holds[name] = Held(hold, late, 0.0, source)
    return structs.replace(model, inputs=inputs), holds


def create(folder: Path | str, template: Path | str, sessions: Path | str | None = None) -> Study:
    """A new study in `folder` after the study file `template`.

    Args:
        folder: is made where there is none.
        template: its comments are kept.
        sessions: folder of the template's sessions; the template's own folder if None.

    Raises:
        ConfigError: the folder holds a study already, the template does not fit, or a session or
            effect file that it names is not there.
    """
    folder, template = Path(folder), Path(template)
    if (folder / FILE).exists():
        raise ConfigError(folder / FILE, "", "a study", "a folder without one")
    file = load(template, StudyFile)
    beside = template.parent if sessions is None else Path(sessions)
    text = template.read_text(encoding="utf-8")
    spans = {span.session: beside for span in (*file.train, *file.held_out, *file.healthy)}
    files = spans | dict.fromkeys(file.effect_files, template.parent)
    if file.model.endswith(".toml"):
        files[file.model] = template.parent
    for name, where in files.items():
        path = where / name
        if not path.exists():
            raise ConfigError(template, name, "no such file or folder", f"it in {where}")
        from_study = os.path.relpath(path.resolve(), folder.resolve())
        text = text.replace(f'"{name}"', f'"{Path(from_study).as_posix()}"')
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FILE).write_text(text, encoding="utf-8")
    try:
        return open_study(folder)
    except RigwatchError:
        (folder / FILE).unlink()
        raise
