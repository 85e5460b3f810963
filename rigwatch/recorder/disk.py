"""How full the disk is that the session goes to, and when to say so."""

import math
import os
from pathlib import Path

from rigwatch.wire.messages import Event, Severity

SOURCE = "recorder"
NEARLY_FULL = 0.10
ALMOST_FULL = 0.02
_LEVELS: tuple[tuple[float, Severity, str], ...] = (
    (ALMOST_FULL, "critical", "DISK_ALMOST_FULL"),
    (NEARLY_FULL, "warning", "DISK_NEARLY_FULL"),
)


def free_share(folder: Path) -> float:
    """Share of the disk of `folder` that is free to us, 0 to 1; NaN where nobody can tell.

    The folder need not exist yet: the nearest one above it is asked.
    """
    for place in (folder, *folder.absolute().parents):
        try:
            found = os.statvfs(place)
        except OSError:
            continue
        return found.f_bavail / found.f_blocks if found.f_blocks else float("nan")
    return float("nan")


class DiskWatch:
    """Says once when the disk gets nearly full, and once when there is room again."""

    def __init__(self) -> None:
        self._level = len(_LEVELS)

    @property
    def short(self) -> bool:
        """Whether there is too little room."""
        return self._level < len(_LEVELS)

    def update(self, share: float, t_ns: int) -> list[Event]:
        """What is to be told now that `share` of the disk is free; NaN changes nothing."""
        if math.isnan(share):
            return []
        level = next(
            (index for index, (limit, _, _) in enumerate(_LEVELS) if share < limit), len(_LEVELS)
        )
        before, self._level = self._level, level
        if level < before:
            _, severity, code = _LEVELS[level]
            return [Event(SOURCE, t_ns, severity, code, f"{share:.1%} of the disk is free")]
        if level > before and not self.short:
            return [Event(SOURCE, t_ns, "info", "DISK_ROOM", f"{share:.1%} of the disk is free")]
        return []
