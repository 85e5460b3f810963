"""Files of effects: the shipped library, the user's own, and those of installed packages."""

from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeVar

from msgspec import field

from rigwatch.physics.engine.equations.composite import Composite, EffectMap, composed
from rigwatch.physics.engine.equations.effect import Effect
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section, parse, read_text

Item = TypeVar("Item")

GROUP = "rigwatch.effects"
"""Entry point group: each is a mapping of effects by name, or a function that returns one."""


class EffectFile(Section, frozen=True, kw_only=True):
    """A file of effects."""

    effects: dict[str, Effect] = field(default_factory=dict)
    maps: dict[str, EffectMap] = field(default_factory=dict)
    composites: dict[str, Composite] = field(default_factory=dict)


def usable(name: str, effect: Effect, file: Path | str) -> Effect:
    """The effect, if its declaration is valid.

    Raises:
        ConfigError: it has no strength or more than one, or a state without an equation.
    """
    strengths = [key for key, p in effect.parameters.items() if p.role in ("strength", "switch")]
    if len(strengths) != 1:
        found = f"{len(strengths)} parameters with role strength or switch"
        raise ConfigError(file, f"effects.{name}.parameters", found, "one")
    for key, state in effect.states.items():
        if bool(state.derivative) == bool(state.update):
            found = "both" if state.derivative else "neither"
            raise ConfigError(file, f"effects.{name}.states.{key}", found, "derivative or update")
    return effect


def load_effects(path: Path | str) -> dict[str, Effect]:
    """The effects of the file at `path`, by name.

    Raises:
        ConfigError: the file is invalid.
    """
    return parse_effects(read_text(Path(path)), path)


def parse_effects(text: str, file: Path | str) -> dict[str, Effect]:
    """The effects in the text of a file, by name; `file` is named in errors.

    Raises:
        ConfigError: the text is invalid.
    """
    found = parse(text, EffectFile, file)
    if not found.effects and not found.composites:
        raise ConfigError(file, "effects", "no effect", "at least one table [effects.NAME]")
    own = {name: usable(name, effect, file) for name, effect in found.effects.items()}
    shipped = _shipped()
    return own | _composites(found, library() | own, shipped.maps | found.maps, file)


def _composites(
    found: EffectFile,
    effects: Mapping[str, Effect],
    maps: Mapping[str, EffectMap],
    file: Path | str,
) -> dict[str, Effect]:
    """The composites of a file as effects."""
    for name in found.composites:
        if name in found.effects:
            raise ConfigError(file, f"composites.{name}", "an effect of this name", "another name")
    return {n: composed(n, own, effects, maps, file) for n, own in found.composites.items()}


@cache
def library() -> dict[str, Effect]:
    """The effects that ship with rigwatch, by name."""
    shipped = _shipped()
    return shipped.effects | _composites(shipped, shipped.effects, shipped.maps, "effects")


@cache
def _shipped() -> EffectFile:
    """All shipped files as one."""
    files = [parse(text, EffectFile, name) for name, text in _texts()]
    return EffectFile(
        effects=_joined(file.effects for file in files),
        maps=_joined(file.maps for file in files),
        composites=_joined(file.composites for file in files),
    )


def _texts() -> list[tuple[str, str]]:
    folder = resources.files("rigwatch.physics") / "effects"
    files = sorted(folder.iterdir(), key=lambda entry: entry.name)
    return [(file.name, file.read_text("utf-8")) for file in files if file.name.endswith(".toml")]


def _joined(tables: Iterable[Mapping[str, Item]]) -> dict[str, Item]:
    found: dict[str, Item] = {}
    for table in tables:
        found |= table
    return found


def offered(files: Iterable[Path | str]) -> dict[str, Effect]:
    """Effects of installed packages and of `files`, by name; the latter take precedence.

    Raises:
        ConfigError: a file is invalid.
    """
    found: dict[str, Effect] = {}
    for entry in entry_points(group=GROUP):
        given = entry.load()
        found |= given() if callable(given) else given
    for name in files:
        found |= load_effects(name)
    return found
