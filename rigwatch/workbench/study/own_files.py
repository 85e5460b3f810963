"""Own effect and model files of a study before they are committed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import read_text
from rigwatch.workbench.study.folder import FILE


@dataclass(frozen=True)
class Unsaved:
    """New content of a file.

    Attributes:
        text: the content.
        before: content of the file that it replaces; None if there is none.
    """

    text: str
    before: str | None = None


NOTHING_UNSAVED: Mapping[str, Unsaved] = MappingProxyType({})


def unsaved(folder: Path, name: str, text: str) -> dict[str, Unsaved]:
    """New content for the file `name` in a study's folder.

    Raises:
        ModelError: the name is that of the study's own file, or no plain name of a TOML file.
    """
    if Path(name).name != name or not name.endswith(".toml") or name == FILE:
        raise ModelError(f"{name}: expected a name such as 'my_effects.toml', other than {FILE}")
    path = folder / name
    return {name: Unsaved(text, read_text(path) if path.exists() else None)}


def content(folder: Path, name: str, given: Mapping[str, Unsaved]) -> str:
    """Content of a study's file, new or as it is in the folder.

    Raises:
        ConfigError: it cannot be read.
    """
    return given[name].text if name in given else read_text(folder / name)


def check_unchanged(folder: Path, opened: Mapping[str, str], given: Mapping[str, Unsaved]) -> None:
    """Check that own files are still as they were.

    Args:
        folder: the study's folder.
        opened: content with which the study was opened, by name.
        given: files to be replaced.

    Raises:
        ModelError: one was changed meanwhile.
    """
    known = {**opened, **{name: new.before for name, new in given.items()}}
    for name, before in known.items():
        path = folder / name
        if (read_text(path) if path.exists() else None) != before:
            raise ModelError(
                f"{path}: the file has been changed since this step was tried; nothing was written"
            )
