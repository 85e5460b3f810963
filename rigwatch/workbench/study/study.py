"""A study: one readable file, `study.toml`, a ledger of every step, and nothing hidden.

The file names a model, recordings to fit and recordings held out, and lists the effects that have
been accepted, one `[[effects]]` table each at its end. Adding an effect writes a table there,
undoing takes the last one away; the rest of the file, with its comments, stays as it was written.
"""

import difflib
import os
import shutil
import tomllib
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
    load_effects,
    load_model,
    offered,
    shipped_models,
    units_at,
)
from rigwatch.physics.engine.fit import Convergence
from rigwatch.wire.errors import ConfigError, ModelError, RigwatchError
from rigwatch.wire.typed_files import Section, load
from rigwatch.wire.units import Unit, unit_of

FILE = "study.toml"
LEDGER = "ledger.jsonl"
_TABLE = "\n[[effects]]\n"
GIVEN = ("the study", "the model file")
"""Sources of holds that nothing was chosen for."""
CHOSEN = "  # chosen from the data, with the first effect"
"""Behind holds that were written with the first effect, and go with it."""


Lateness = Annotated[float, Meta(ge=0, le=1)]


class Span(Section, frozen=True, kw_only=True):
    """A recording, or a part of one."""

    session: Annotated[str, Meta(description="session file, from the study's folder")]
    start: Annotated[float, Meta(ge=0, description="seconds into it where the part begins")] = 0.0
    end: Annotated[float, Meta(description="seconds into it where the part ends")] = float("inf")


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
    train: Annotated[tuple[Span, ...], Meta(min_length=1, description="what is fitted to")]
    held_out: Annotated[tuple[Span, ...], Meta(min_length=1, description="what decides")]
    healthy: Annotated[
        tuple[Span, ...], Meta(description="recordings with nothing wrong, for the noise floor")
    ] = ()
    horizon: Annotated[float, Meta(gt=0, description="time between re-initialisations [s]")] = 0.5
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
    """

    folder: Path
    file: StudyFile
    model: Model
    effects: Mapping[str, Effect]
    own: frozenset[str]
    kept: Kept | None = None
    holds: Mapping[str, Held] = dataclass_field(default_factory=dict)

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


def nearest(name: str, known: Mapping[str, object]) -> str:
    """The end of a sentence that found `name`: what may have been meant, or what there is."""
    close = " or ".join(map(repr, difflib.get_close_matches(name, known, 3, 0.5)))
    return f"; did you mean {close}?" if close else f", expected one of {', '.join(sorted(known))}"


def open_study(folder: Path | str) -> Study:
    """The study in `folder`.

    Raises:
        ConfigError: there is none, or its file does not fit.
        ModelError: its model or one of its effects is unknown.
    """
    folder = Path(folder)
    path = folder / FILE
    if not path.is_file():
        raise ConfigError(path, "", "no such file", "a study; make one with `rigwatch study new`")
    file = load(path, StudyFile)
    given = offered(folder / name for name in file.effect_files)
    effects = {**library(), **given}
    model, holds = _held(_model(folder, file.model), file)
    study = Study(folder, file, model, effects, frozenset(given), holds=holds)
    for accepted in file.effects:
        study.effect(accepted.effect)
    return _in_si(study)


def _in_si(study: Study) -> Study:
    """The study with the values of its file in SI; there they stand in the parameters' units."""
    start = {
        name: _unit(study.model.parameters.get(name)).to_si(value)
        for name, value in study.file.start.items()
    }
    effects = [_converted(study, a, "to_si") for a in study.file.effects]
    return replace(study, file=structs.replace(study.file, start=start, effects=tuple(effects)))


def _converted(study: Study, accepted: Accepted, way: Literal["to_si", "from_si"]) -> Accepted:
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


def _model(folder: Path, name: str) -> Model:
    if name.endswith(".toml"):
        path = folder / name
        model = load_model(path)
        check_model(model, str(path))
        return model
    models = shipped_models()
    if name not in models:
        raise ModelError(f"{folder / FILE}: found model {name!r}{nearest(name, models)}")
    return models[name]


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


def append_effect(study: Study, accepted: Accepted) -> Study:
    """The study with one more effect in its file, its values in the units of its parameters."""
    written = _converted(study, accepted, "from_si")
    table = f'effect = "{accepted.effect}"\nport = "{accepted.port}"\n'
    table += f"parameters = {_inline(written.parameters)}\n"
    if written.model:
        table += f"model = {_inline(written.model)}\n"
    text = _text(study).rstrip() + "\n" + _TABLE + table
    return _rewritten(study, text)


def _inline(values: Mapping[str, float]) -> str:
    """Numbers by name as an inline table."""
    return f"{{ {', '.join(f'{name} = {value!r}' for name, value in values.items())} }}"


def drop_effect(study: Study) -> Study:
    """The study without the effect that its file lists last.

    Raises:
        ModelError: there is none, or the table does not stand at the end of the file.
    """
    text = _text(study)
    at = text.rfind(_TABLE)
    if not study.file.effects or at < 0:
        raise ModelError(f"{study.folder}: found no effect to undo")
    text = text[:at].rstrip() + "\n"
    if len(study.file.effects) == 1:
        text = "".join(line for line in text.splitlines(True) if CHOSEN not in line)
    return _rewritten(study, text)


def use_effect_file(study: Study, path: Path) -> Study:
    """The study with a copy of the user's effect file, whose effects join the others.

    Raises:
        ConfigError: the file does not fit.
    """
    load_effects(path)
    target = study.folder / path.name
    if path.resolve() != target.resolve():
        shutil.copyfile(path, target)
    names = [*dict.fromkeys([*study.file.effect_files, path.name])]
    line = f"effect_files = [{', '.join(repr(n).replace(chr(39), chr(34)) for n in names)}]\n"
    kept = [x for x in _text(study).splitlines(True) if not x.startswith("effect_files")]
    return _rewritten(study, line + "".join(kept))


def keep_holds(study: Study) -> Study:
    """The study with the holds that the data have chosen in its file, so that they stay."""
    chosen = {n: h for n, h in study.holds.items() if h.source not in GIVEN}
    if not chosen or study.file.hold:
        return study
    holds = ", ".join(f'{name} = "{held.hold}"' for name, held in chosen.items())
    late = ", ".join(f"{name} = {held.late!r}" for name, held in chosen.items() if held.late)
    lines = f"hold = {{ {holds} }}{CHOSEN}\n" + (f"late = {{ {late} }}{CHOSEN}\n" if late else "")
    return _rewritten(study, lines + _text(study))


def _text(study: Study) -> str:
    return (study.folder / FILE).read_text(encoding="utf-8")


def _rewritten(study: Study, text: str) -> Study:
    """Write the file whole or not at all, after a look at whether it can be read back."""
    tomllib.loads(text)
    path = study.folder / FILE
    beside = path.with_suffix(".new")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
    return open_study(study.folder)
