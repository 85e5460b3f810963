"""Reports when the disk of the sessions runs full, and when there is space again."""

import math

from rigwatch.wire.messages import Event, Severity

SOURCE = "recorder"
NEARLY_FULL = 0.10
ALMOST_FULL = 0.02
_LEVELS: tuple[tuple[float, Severity, str], ...] = (
    (ALMOST_FULL, "critical", "DISK_ALMOST_FULL"),
    (NEARLY_FULL, "warning", "DISK_NEARLY_FULL"),
)


class DiskWatch:
    """Reports once when the disk is nearly full, and once when there is space again."""

    def __init__(self) -> None:
        self._level = len(_LEVELS)

    @property
    def level(self) -> int:
        """Index of the limit that the free space has fallen below; the highest if of none."""
        return self._level

    @property
    def short(self) -> bool:
        """Whether there is too little space."""
        return self._level < len(_LEVELS)

    def update(self, share: float, t_ns: int) -> list[Event]:
        """Events for a free share of the disk; NaN is ignored."""
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
