"""Creates a study file from a template's settings and the user's recordings."""

import os
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs

from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.errors import ConfigError, RigwatchError
from rigwatch.wire.typed_files import as_toml, find_file, load, shipped_names
from rigwatch.workbench.study import FILE, Span, Study, StudyFile, start_study

USES = ("train", "held_out", "healthy")
Part = tuple[str, Path, float, float | None]
"""Use, recording, start and end [s] of a part of a study."""


def template_names(own: Path) -> dict[str, list[str]]:
    """Names of templates, models and own models, in the folder `own`, to start from."""
    usable = [n for n in shipped_names("studies") if not _template(n).model.endswith(".toml")]
    mine = sorted(path.name for path in own.glob("*.toml"))
    return {"templates": usable, "models": list(shipped_models()), "own": mine}


def template_data(name: str) -> dict[str, Any]:
    """A template's recordings: file, use and span of each."""
    file = _template(name)
    spans = [
        {
            "use": use,
            "session": span.session,
            "start": span.start,
            "end": span.end if isfinite(span.end) else None,
        }
        for use in USES
        for span in getattr(file, use)
    ]
    signals = list(shipped_models()[file.model].inputs) + list(shipped_models()[file.model].outputs)
    return {"model": file.model, "spans": spans, "signals": signals}


def _template(name: str) -> StudyFile:
    """A shipped template; other files are not accepted."""
    if name not in (known := shipped_names("studies")):
        raise RigwatchError(f"found template {name!r}, expected one of {', '.join(known)}")
    return load(find_file(name, "studies"), StudyFile)


def make_study(
    folder: Path,
    begin: str,
    spans: Sequence[Part],
    own: Path | None = None,
    values: Mapping[str, float] | None = None,
    *,
    variants: Sequence[str] = (),
) -> Study:
    """Create a study in `folder`.

    Args:
        folder: without a study.
        begin: name of a template, or "model:" followed by the name of a model.
        own: own model file in place of `begin`.
        values: initial values of the model's parameters, in its units.
        variants: of the model.
        spans: use, recording, start and end [s] of each part.

    Raises:
        RigwatchError: there is a study already, or the parts are invalid.
    """
    if (folder / FILE).exists():
        raise ConfigError(folder / FILE, "", "an existing study", "another name")
    parts: dict[str, list[Span]] = {use: [] for use in USES}
    for use, path, start, end in spans:
        if use not in parts:
            raise RigwatchError(f"found use {use!r}, expected one of {', '.join(USES)}")
        name = _from(folder, path)
        parts[use].append(Span(session=name, start=start, end=float("inf") if end is None else end))
    if not (parts["train"] and parts["held_out"]):
        raise RigwatchError("found no training or no held-out recording, expected one of each")
    train, held_out, healthy = (tuple(parts[use]) for use in USES)
    kind, _, model = begin.partition(":")
    if own is not None:
        file = StudyFile(model=_from(folder, own), train=train, held_out=held_out, healthy=healthy)
    elif model:
        if model not in (known := shipped_models()):
            raise RigwatchError(f"found model {model!r}, expected one of {', '.join(known)}")
        file = StudyFile(model=model, train=train, held_out=held_out, healthy=healthy)
    else:
        file = structs.replace(_template(kind), train=train, held_out=held_out, healthy=healthy)
    if values:
        file = structs.replace(file, start=dict(values))
    if variants:
        file = structs.replace(file, variants=tuple(variants))
    return start_study(folder, as_toml(_said(file)))


def _from(folder: Path, path: Path) -> str:
    """A path relative to a study's folder."""
    return Path(os.path.relpath(path, folder)).as_posix()


def _said(section: msgspec.Struct) -> dict[str, Any]:
    """The fields of a section that differ from their defaults."""
    found = {}
    for field in structs.fields(section):
        value = getattr(section, field.name)
        default = field.default
        if default is msgspec.NODEFAULT and field.default_factory is not msgspec.NODEFAULT:
            default = field.default_factory()
        if value != default:
            found[field.encode_name] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, msgspec.Struct):
        return _said(value)
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    return value
