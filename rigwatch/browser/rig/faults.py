"""Errors that nobody expects, in a loop behind the pages: told, and no reason to end.

A thread or task that ended would leave the pages as they are, without a word.
"""

import logging

from rigwatch.wire.errors import one_line

_log = logging.getLogger(__name__)
MOST = 20
"""Different errors of a loop that are logged."""


class Faults:
    """The unexpected errors of one loop, each logged once with its traceback.

    Args:
        what: the loop, at the beginning of a sentence.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._logged: set[str] = set()

    def told(self, error: Exception) -> str:
        """One line about the error, for the page."""
        text = f"{self._what} failed: {type(error).__name__}: {one_line(error)}"
        if text not in self._logged and len(self._logged) < MOST:
            self._logged.add(text)
            _log.error("%s; it begins anew", text, exc_info=error)
        return text
