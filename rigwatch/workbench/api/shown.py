"""Results that display themselves in a terminal and in a notebook."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Generic, TypeVar

from rigwatch.workbench.api.data_frames import NamedArrays, records

Found = TypeVar("Found")
Rows = Sequence[Mapping[str, object]]


class Shown(Generic[Found]):
    """A result with a text representation.

    Args:
        found: the result object.
        lines: its text.
        rows: its table.

    Attributes:
        found: the result object.
    """

    def __init__(
        self,
        found: Found,
        lines: Callable[[Found], Sequence[str]],
        rows: Callable[[Found], Rows],
    ) -> None:
        self.found, self._lines, self._rows = found, lines, rows

    def table(self) -> NamedArrays:
        """The result's table as columns, which convert to a data frame."""
        return records(self._rows(self.found))

    def __repr__(self) -> str:
        return "\n".join(self._lines(self.found))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"
