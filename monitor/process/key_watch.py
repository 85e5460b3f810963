"""The alarm of certificates that end: then a restart of the router leaves the rig unwatched."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from monitor.process.link_watch import Cause, Report, Seen
from rigwatch.wire.access import ending_soon, ends_text, read_register
from rigwatch.wire.errors import KeysError

BETWEEN_NS = 60 * 1_000_000_000
"""Time between two checks of the register [ns]."""


class KeyWatch:
    """Decides whether the alarm `certificates_end` holds; reads the register, not the clock.

    Args:
        keys: folder of keys; "" if the rig has none.
    """

    def __init__(self, keys: str) -> None:
        self._keys = keys
        self._due_ns: int | None = None
        self._text = ""

    def reports(self, seen: Seen) -> Iterator[Report]:
        """The alarm; without keys it never holds."""
        if self._keys and (self._due_ns is None or seen.monotonic_ns >= self._due_ns):
            self._due_ns = seen.monotonic_ns + BETWEEN_NS
            self._text = self._checked(seen.t_ns)
        yield "certificates_end", Cause(text=self._text), bool(self._text)

    def _checked(self, t_ns: int) -> str:
        """Which certificates end soon; what was found before if the register cannot be read."""
        today = datetime.fromtimestamp(t_ns / 1e9, UTC).date()
        try:
            soon = ending_soon(read_register(Path(self._keys)), today)
        except KeysError:  # the router reports it
            return self._text
        return ends_text(soon)
