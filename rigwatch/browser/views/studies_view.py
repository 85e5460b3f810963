"""The list of studies: what each says at a glance."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rigwatch.browser.views.study_state import State, state_of
from rigwatch.browser.views.study_view import headline
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.study import FILE

DEEP = 3
"""Folders below the root in which studies are looked for."""


@dataclass(frozen=True)
class Listed:
    """A study of the list.

    Attributes:
        name: from the root.
        state: None where it cannot be opened.
        trouble: why not.
        errors: held-out error of each step over that of the model alone, as far as they are known.
    """

    name: str
    state: State | None
    trouble: str = ""

    @property
    def verdict(self) -> str:
        """In a sentence."""
        return headline(self.state) if self.state else self.trouble

    @property
    def errors(self) -> list[float]:
        """Held-out errors of the steps, as the ledger tells them where no fit is at hand."""
        if self.state is None:
            return []
        return [s.comparison.held_out_error for s in self.state.steps if s.comparison]

    @property
    def last(self) -> str:
        """What was done last."""
        ledger = self.state.ledger if self.state else []
        if not ledger:
            return ""
        line = ledger[-1]
        what = f" {line['effect']}" if "effect" in line else ""
        return f"{line['step']}{what}, {line['time'][:16].replace('T', ' ')}".replace("_", " ")


def listed(root: Path) -> list[Listed]:
    """Every study below a folder."""
    return [_listed(root, folder) for folder in _folders(root)]


def _listed(root: Path, folder: Path) -> Listed:
    name = folder.relative_to(root).as_posix()
    try:
        return Listed(name, state_of(folder, name))
    except (RigwatchError, OSError) as error:
        return Listed(name, None, str(error))


def _folders(root: Path) -> Iterator[Path]:
    """Folders with a study; links that lead out of the root are not followed."""
    found = {
        path.parent
        for depth in range(1, DEEP + 1)
        for path in root.glob("/".join(["*"] * depth + [FILE]))
        if path.resolve().is_relative_to(root.resolve())
    }
    return iter(sorted(found))
