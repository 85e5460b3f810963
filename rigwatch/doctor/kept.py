"""One file that a rig's processes keep: what they read from it, and how it is mended.

A file is mended in place. What it was before stays beside it, as `<name>.backup-<time>`.
"""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.doctor.finding import Finding, Level
from rigwatch.wire.errors import ConfigError, reason_of


@dataclass(frozen=True, slots=True)
class Kept:
    """A file, as the process that keeps it reads it.

    Attributes:
        what: kind of file.
        path: the file.
        text: what was read, and what is wrong with it.
        level: of the finding while it is not mended.
        change: what mending does, in words; empty if there is nothing to mend.
        mend: writes the mended file; it finds the old one at its path and in its backup.
        remedy: what a person does where nothing can be mended.
        backup: whether the file is kept beside it as it was.
    """

    what: str
    path: Path
    text: str
    level: Level = "ok"
    change: str = ""
    mend: Callable[[], None] | None = None
    remedy: str = ""
    backup: bool = True

    def finding(self, config: Path) -> Finding:
        """What was found, with the command that mends it."""
        fix = f"rigwatch doctor {config} --fix: {self.change}"
        remedy = fix if self.change else self.remedy
        return Finding(self.what, self.level, f"{self.path}: {self.text}", remedy)


def mended(kept: Kept) -> Finding:
    """Mend a file and say what was done.

    Raises:
        ConfigError: the backup or the file cannot be written.
    """
    assert kept.mend is not None
    backup = backup_of(kept.path)
    try:
        if kept.backup:
            shutil.copy2(kept.path, backup)
        kept.mend()
    except OSError as error:
        raise ConfigError(kept.path, "", reason_of(error), "a file to write") from error
    before = f"; as it was: {backup.name}" if kept.backup else ""
    return Finding(kept.what, "ok", f"{kept.path}: {kept.text}; done: {kept.change}{before}")


def backup_of(path: Path) -> Path:
    """A name beside `path` that is not taken."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    found, number = path.with_name(f"{path.name}.backup-{stamp}"), 2
    while found.exists():
        found = path.with_name(f"{path.name}.backup-{stamp}-{number}")
        number += 1
    return found


def users_of(paths: set[Path]) -> list[int]:
    """Processes of this machine that have one of the files open, as far as they may be seen."""
    wanted = {str(path.resolve()) for path in paths}
    found = set()
    for entry in Path("/proc").glob("[0-9]*/fd/*"):
        try:
            if str(entry.readlink()) in wanted:
                found.add(int(entry.parts[2]))
        except OSError:
            continue  # ended meanwhile, or of another user
    return sorted(found)
