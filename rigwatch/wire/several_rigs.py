"""Configurations of several rigs that one process works on: none may take what is another's."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig, load_rig


def load_rigs(paths: Sequence[Path]) -> list[tuple[Path, RigConfig]]:
    """The configurations at `paths`, each with its path.

    Raises:
        ConfigError: one is invalid, or two are of one rig on one router.
    """
    loaded = [(path, load_rig(path)) for path in paths]
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
            raise ConfigError(path, key, f"that of {other}", "one of its own")
