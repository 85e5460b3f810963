"""Configurations of several rigs that one process works on: none may take what is another's."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig, load_rig

Rigs = Sequence[tuple[Path, RigConfig]]
"""Configurations of rigs, each with its path."""


def valid_rigs(
    paths: Sequence[Path], say: Callable[[str], object] | None = None
) -> list[tuple[Path, RigConfig]]:
    """The configurations at `paths`, each with its path, without files that are wrong.

    Args:
        paths: the files.
        say: told of each that is wrong.

    Raises:
        ConfigError: all are invalid, or two are of one rig on one router.
    """
    loaded, mistakes = [], []
    for path in paths:
        try:
            loaded.append((path, load_rig(path)))
        except ConfigError as error:
            mistakes.append(error)
    if mistakes and not loaded:
        raise mistakes[0]
    if say is not None:
        for mistake in mistakes:
            say(str(mistake))
    return apart(loaded)


def apart(loaded: list[tuple[Path, RigConfig]]) -> list[tuple[Path, RigConfig]]:
    """The same configurations.

    Raises:
        ConfigError: two are of one rig on one router.
    """
    check_own("rig.id", ((path, f"{config.bus.router} {config.rig.id}") for path, config in loaded))
    return loaded


def check_own(key: str, values: Iterable[tuple[Path, str]]) -> None:
    """Refuse two files with one value of a key.

    Args:
        key: name of the key.
        values: each file with its value.

    Raises:
        ConfigError: names the second file and the first.
    """
    seen: dict[str, Path] = {}
    for path, value in values:
        other = seen.setdefault(value, path)
        if other is not path:
            raise ConfigError(path, key, f"the same as in {other}", "a value of its own")
