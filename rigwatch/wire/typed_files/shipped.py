"""The example files that come with rigwatch: rigs, scenarios, studies, mappings, structures.

They are in the folder `configs` of the checkout, which the wheel contains as package data. Commands
accept a path or a name: `--template emps` is `configs/studies/emps.toml`.
"""

import difflib
import shutil
from pathlib import Path

from rigwatch.wire.errors import ConfigError, reason_of
from rigwatch.wire.new_file import new_file

FOLDER = "configs"
KINDS = ("imports", "plants", "rigs", "scenarios", "structures", "studies")


def shipped_folders() -> tuple[Path, ...]:
    """Existing `configs` folders: in the working folder, the checkout, or the installed wheel."""
    package = Path(__file__).parents[2]
    roots = (Path(), package.parent, package)
    return tuple(root / FOLDER for root in roots if (root / FOLDER).is_dir())


def find_config(name: str) -> Path:
    """The file `name` in the folder `configs`.

    Raises:
        ConfigError: there is none.
    """
    for folder in shipped_folders():
        if (folder / name).is_file():
            return folder / name
    raise ConfigError(f"{FOLDER}/{name}", "", "no such file", "a folder with rigwatch's configs")


def shipped_names(kind: str) -> list[str]:
    """Names of the shipped files of a kind, such as "studies"; those of the rigs if empty."""
    files = (path for folder in shipped_folders() for path in (folder / kind).glob("*.toml"))
    return sorted({path.stem for path in files})


def find_file(given: Path | str, kind: str) -> Path:
    """A user's own file, otherwise the shipped one of that path or name.

    Args:
        given: path or name; a path that does not exist is returned unchanged.
        kind: folder of `configs` that is searched for a name.

    Raises:
        ConfigError: a name, without folder and suffix, is unknown; the message suggests near ones.
    """
    path = Path(given)
    if path.is_file():
        return path
    inside = path.relative_to(FOLDER) if path.parts[:1] == (FOLDER,) else Path(kind, path)
    for folder in shipped_folders():
        for found in (folder / inside, folder / inside.with_name(f"{inside.name}.toml")):
            if found.is_file():
                return found
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = shipped_names(kind)
    close = difflib.get_close_matches(str(given), known, 3, 0.5) or known
    raise ConfigError(given, "", "no such file", f"a file or one of {', '.join(close)}")


def copy_out(folder: Path) -> tuple[list[Path], list[Path]]:
    """Copy all of them to `folder`/configs; returns those copied, and existing ones that are kept.

    Raises:
        ConfigError: the shipped files are not found, or the folder cannot be written.
    """
    target = folder / FOLDER
    sources = [own for own in shipped_folders() if own.resolve() != target.resolve()]
    if not sources:
        raise ConfigError(target, "", "rigwatch's own files", "another folder")
    source, copied, kept = sources[-1], list[Path](), list[Path]()
    for file in sorted(source.rglob("*.toml")):
        to = target / file.relative_to(source)
        if to.exists():
            kept.append(to)
            continue
        try:
            to.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(to, "", reason_of(error), "a folder to write") from error
        with new_file(to) as part:
            shutil.copyfile(file, part)
        copied.append(to)
    return copied, kept
