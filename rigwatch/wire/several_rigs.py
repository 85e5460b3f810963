"""Configurations of several rigs that one process works on: none may take what is another's."""

from collections.abc import Callable, Iterable
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig, load_rig


def load_rigs(
    paths: Iterable[Path], say: Callable[[str], None] | None = None
) -> list[tuple[Path, RigConfig]]:
    """The configurations of several rigs, each with its path.

    Args:
        paths: the files.
        say: called with the mistake of a file, which is left out; None refuses all because of it.

    Raises:
        ConfigError: a file is invalid, all are if `say` is given, or two are of one rig on one
            router.
    """
    loaded, wrong = [], None
    for path in paths:
        try:
            loaded.append((path, load_rig(path)))
        except ConfigError as error:
            if say is None:
                raise
            wrong = error
            say(str(error))
    if wrong is not None and not loaded:
        raise wrong
    check_own("rig.id", ((path, f"{config.bus.router} {config.rig.id}") for path, config in loaded))
    return loaded


def check_rigs(paths: Iterable[Path]) -> None:
    """Check that a process of several rigs can begin: it names wrong files rig by rig.

    Raises:
        ConfigError: no file is valid, or two are of one rig on one router.
    """
    load_rigs(paths, list[str]().append)


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
            raise ConfigError(path, key, f"that of {other}", "one of its own")
