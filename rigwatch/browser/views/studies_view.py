"""The list of studies with a summary of each."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rigwatch.browser.recordings import visible_files
from rigwatch.browser.views.study_state import State, state_of
from rigwatch.browser.views.study_view import headline
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.study import FILE, LEDGER


@dataclass(frozen=True)
class Listed:
    """A study of the list.

    Attributes:
        name: path relative to the root.
        state: None if it cannot be opened.
        trouble: why it cannot be opened.
        errors: held-out error of each step over that of the model alone, as far as known.
    """

    name: str
    state: State | None
    trouble: str = ""

    @property
    def verdict(self) -> str:
        """The verdict in a sentence."""
        return headline(self.state) if self.state else self.trouble

    @property
    def errors(self) -> list[float]:
        """Held-out errors of the steps, from the ledger if there is no fit."""
        if self.state is None:
            return []
        return [s.comparison.held_out_error for s in self.state.steps if s.comparison]

    @property
    def last(self) -> str:
        """The last step."""
        ledger = self.state.ledger if self.state else []
        if not ledger:
            return ""
        line = ledger[-1]
        what = f" {line['effect']}" if "effect" in line else ""
        return f"{line['step']}{what}, {line['time'][:16].replace('T', ' ')}".replace("_", " ")


def listed(root: Path) -> list[Listed]:
    """All studies below a folder."""
    return [_listed(root, folder) for folder in study_folders(root)]


def stamp(folder: Path) -> object:
    """A value that changes with the study's files."""
    return tuple(_state(folder / name) for name in (FILE, LEDGER))


def _state(file: Path) -> tuple[int, int, int]:
    try:
        found = file.stat()
    except OSError:
        return (0, 0, 0)
    return (found.st_ino, found.st_size, found.st_mtime_ns)


def _listed(root: Path, folder: Path) -> Listed:
    name = folder.relative_to(root).as_posix()
    try:
        return Listed(name, state_of(folder, name))
    except (RigwatchError, OSError) as error:
        return Listed(name, None, str(error))


def study_folders(root: Path) -> Iterator[Path]:
    """Folders with a study; links that lead out of the root are not followed."""
    found = {path.parent for path in visible_files(root) if path.name == FILE}
    return iter(sorted(found - {root}))
