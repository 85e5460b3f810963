"""Additional effects: from installed packages and the user's own files."""

from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path

from rigwatch.physics.engine.equations.effect import Effect, load_effects

GROUP = "rigwatch.effects"
"""Entry point group: each is a mapping of effects by name, or a function that returns one."""


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
