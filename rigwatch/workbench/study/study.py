"""A study: one readable file, `study.toml`, and a ledger of every step.

The file names a model, training and held-out recordings, and lists the accepted effects, one
`[[effects]]` table each at its end. Adding an effect appends a table, undoing removes the last one;
the rest of the file, including comments, is left unchanged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Literal

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from rigwatch.physics.engine.equations import (
    Effect,
    EffectParameter,
    Hold,
    Model,
    Parameter,
    Placement,
    check_model,
    library,
    model_named,
    offered,
    parse_effects,
    parse_model,
    units_at,
    with_variants,
)
from rigwatch.physics.engine.search import Convergence
from rigwatch.wire.errors import ConfigError, ModelError, nearest
from rigwatch.wire.typed_files import parse, read_text
from rigwatch.wire.units import Unit, unit_of
from rigwatch.workbench.study.elements import elements_of, with_element, written_variants
from rigwatch.workbench.study.folder import FILE, LEDGER, settle
from rigwatch.workbench.study.known_values import check_values, with_known_values
from rigwatch.workbench.study.moving_parameters import fitted_by_recording, told_apart
from rigwatch.workbench.study.own_files import NOTHING_UNSAVED, Unsaved, content
from rigwatch.workbench.study.recording_parameters import (
    Known,
    known_as_inputs,
    known_in_si,
    known_of,
)
from rigwatch.workbench.study.stated_noise import noise_in_si
from rigwatch.workbench.study.study_file import Accepted, StudyFile
from rigwatch.workbench.study.told_units import with_shown_units

GIVEN = ("the study", "the model file")
"""Sources of holds that were given rather than chosen from data."""
HEALTHY, RECORDINGS = "the healthy recording", "the recordings"
"""Sources of a hold that is chosen from data; the healthy recording is fitted without effects."""


@dataclass(frozen=True, eq=False)
class Kept:
    """Parameters estimated from the healthy recording.

    Attributes:
        names: names of the parameters.
        covariance: of their values, shape (names, names).
        convergence: how the fit ended; None if not checked.
    """

    names: tuple[str, ...]
    covariance: NDArray[np.float64]
    convergence: Convergence | None = None


@dataclass(frozen=True)
class Held:
    """Hold of an input between samples, and its source.

    Attributes:
        hold: "linear" (first-order) or "zero" (zero-order hold).
        late: delay of a zero-order hold, as a share of the sample period; -1 if a row has the
            value of the interval that ends there.
        seconds: the same [s]; 0 while the sample period is unknown.
        source: where the hold comes from, in words.
        error_ratio: error with this hold over that with a linear one; None if not compared.
    """

    hold: Hold
    late: float
    seconds: float
    source: str
    error_ratio: float | None = None

    @property
    def acting(self) -> float:
        """The delay within the interval that a value acts in, from 0 to 1."""
        return self.late + 1 if self.late < 0 else self.late

    @property
    def ends(self) -> bool:
        """Whether a row has the value of the interval that ends there, not of the next."""
        return self.late < 0


@dataclass(frozen=True)
class Study:
    """An open study; parameter values are in SI, regardless of the units in its file.

    Attributes:
        folder: the study's folder.
        file: the parsed file.
        model: the base model.
        effects: all available effects by name: shipped, from entry points, own.
        own: names of those that are not shipped.
        kept: parameters from the healthy recording, None before they are estimated.
        holds: holds of inputs by name, if known.
        text: content of the file when opened.
        horizon_from: what the horizon was chosen from, in words; empty if given.
        own_files: content of own effect and model files when opened, by name.
        unsaved: own files, by name, that `commit` is to write.
        known: what the file gives for single recordings.
        elements: effects of the healthy machine, scaled for their ports, see `elements.py`.
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
    own_files: Mapping[str, str] = dataclass_field(default_factory=dict)
    unsaved: Mapping[str, Unsaved] = dataclass_field(default_factory=dict)
    known: tuple[Known, ...] = ()
    elements: tuple[Placement, ...] = ()

    @property
    def ledger(self) -> Path:
        """The ledger's file."""
        return self.folder / LEDGER

    def sessions(self) -> dict[str, Path]:
        """Paths of the recordings, by their names in the file."""
        spans = (*self.file.train, *self.file.held_out, *self.file.healthy)
        return {span.session: self.folder / span.session for span in spans}

    def moving(self) -> tuple[str, ...]:
        """Parameters that are fitted per recording, one for each session."""
        return tuple(n for n, p in self.model.parameters.items() if p.per_recording)

    def with_effects(self, effects: Sequence[Accepted]) -> "Study":
        """The study with these effects in its model, in memory only."""
        return replace(self, file=structs.replace(self.file, effects=tuple(effects)))

    def effect(self, name: str) -> Effect:
        """The effect named `name`.

        Raises:
            ModelError: there is none; the message suggests near matches.
        """
        if name not in self.effects:
            raise ModelError(f"found no effect {name!r}{nearest(name, self.effects)}")
        return self.effects[name]

    def effect_at(self, name: str, port: str) -> Effect:
        """The effect named `name` with the units of a port, values in SI.

        Raises:
            ModelError: it is unknown, or the port lacks a variable that its units refer to.
        """
        effect = self.effect(name)
        if port not in self.model.ports:
            return effect
        return effect.at(units_at(self.model, port), f"effect {name} at {port}")


def open_study(folder: Path | str) -> Study:
    """The study in `folder`, which may also be given as its file.

    Raises:
        ConfigError: there is none, or its file is invalid.
        ModelError: its model or one of its effects is unknown.
    """
    folder = Path(folder)
    if folder.name == FILE and folder.is_file():
        folder = folder.parent
    path = folder / FILE
    settle(folder)
    if not path.is_file():
        raise ConfigError(path, "", "no such file", "a study; make one with `rigwatch study new`")
    return study_of(folder, read_text(path))


def study_of(folder: Path, text: str, unsaved: Mapping[str, Unsaved] = NOTHING_UNSAVED) -> Study:
    """The study that `text` describes in `folder`; nothing is written.

    Args:
        folder: the study's folder.
        text: content of its file.
        unsaved: files that take the place of those in the folder.

    Raises:
        ConfigError: the text is invalid.
        ModelError: its model or one of its effects is unknown.
    """
    file = parse(text, StudyFile, folder / FILE)
    own_files = {name: content(folder, name, unsaved) for name in _own_names(file)}
    given = offered(())
    for name in file.effect_files:
        given |= parse_effects(own_files[name], folder / name)
    effects = {**library(), **given}
    written = _written(folder, file, own_files)
    in_si = known_in_si(written, file, folder / FILE)
    check_values(written, file, folder / FILE)
    known, file = known_of(written, file), told_apart(written, in_si)
    model, holds = _as_studied(written, file)
    study = Study(
        folder,
        file,
        model,
        effects,
        frozenset(given),
        holds=holds,
        text=text,
        own_files=own_files,
        unsaved=unsaved,
        known=known,
    )
    for accepted in file.effects:
        study.effect(accepted.effect)
    for element in elements_of(file.variants):
        study.effect(element.effect)
        if element.port not in model.ports:
            meant = nearest(element.port, model.ports)
            raise ModelError(f"variants: found port {element.port!r} in {element.label}{meant}")
    return _in_si(study)


def _in_si(study: Study) -> Study:
    """The study with the values of its file converted from the parameters' units to SI."""
    start = {
        name: _unit(study.model.parameters.get(name)).to_si(value)
        for name, value in study.file.start.items()
    }
    effects = [converted(study, a, "to_si") for a in study.file.effects]
    widths = {
        name: _width(_unit(study.model.parameters.get(name)), value)
        for name, value in study.file.deviation.items()
    }
    noise = noise_in_si(study.file.noise, study.model)
    file = structs.replace(
        study.file, start=start, deviation=widths, noise=noise, effects=tuple(effects)
    )
    return replace(study, file=file, model=with_known_values(study.model, file))


def _width(unit: Unit, value: float) -> float:
    """A difference in SI, whatever the zero of its unit."""
    return float(unit.to_si(value) - unit.to_si(0.0))


def converted(study: Study, accepted: Accepted, way: Literal["to_si", "from_si"]) -> Accepted:
    """An accepted effect with its values converted from the parameters' units to SI or back."""
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
    """The parameter named `name` in the system: the model's, or one of an accepted effect."""
    for accepted in study.file.effects:
        prefix = f"{accepted.port}_{accepted.effect}_"
        own = study.effect_at(accepted.effect, accepted.port).parameters
        if name.startswith(prefix) and name[len(prefix) :] in own:
            return own[name[len(prefix) :]]
    return study.model.parameters.get(name)


def _unit(parameter: Parameter | EffectParameter | None) -> Unit:
    """The unit in which a parameter's values are written."""
    return unit_of((parameter.shown or parameter.unit) if parameter else "")


def _own_names(file: StudyFile) -> tuple[str, ...]:
    """Names of the own effect and model files."""
    return (*file.effect_files, *((file.model,) if file.model.endswith(".toml") else ()))


def _written(folder: Path, file: StudyFile, own_files: Mapping[str, str]) -> Model:
    """The study's model with its variants, without holds."""
    if not file.model.endswith(".toml"):
        return with_variants(model_named(file.model), written_variants(file.variants))
    path = folder / file.model
    model = parse_model(own_files[file.model], path)
    check_model(model, str(path))
    return with_variants(model, written_variants(file.variants))


def varied(study: Study, variants: Sequence[str]) -> Study:
    """The study with these model variants, in memory only.

    Raises:
        ModelError: a variant is unknown, or two of them exclude each other.
    """
    file = structs.replace(study.file, variants=tuple(variants))
    written = _written(study.folder, file, study.own_files)
    named = {element.label for element in elements_of(variants)}
    for element in study.elements:
        if element.label in named:
            written = with_element(written, element)
    model, holds = _as_studied(written, file)
    model = with_known_values(model, file)
    return replace(study, file=file, model=model, kept=None, holds=holds)


def physics_of(study: Study, name: str) -> str:
    """The physics of a variant or of an element, in words."""
    for element in elements_of((name,)):
        return study.effect(element.effect).physics
    return study.model.variants[name].physics


def _as_studied(model: Model, file: StudyFile) -> tuple[Model, dict[str, Held]]:
    """The model with what its recordings and the study give, and all holds.

    Raises:
        ModelError: the study names an input or output that the model does not have.
    """
    by_recording = fitted_by_recording(known_as_inputs(model, file), file)
    return _held(with_shown_units(by_recording, file), file)


def _held(model: Model, file: StudyFile) -> tuple[Model, dict[str, Held]]:
    """The model with the holds given in the study, and all holds given in either.

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
        given = RECORDINGS if file.holds_chosen else "the study"
        source = given if hold else "the model file"
        hold = hold or own.hold or model.hold
        late = own.late if late is None else late
        held = Held(hold, late, 0.0, source) if hold else None
        inputs[name] = structs.replace(own, hold=hold, late=held.acting if held else late)
        if held and not own.constant:
            holds[name] = held
    return structs.replace(model, inputs=inputs), holds
