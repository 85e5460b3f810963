"""Output to terminals and pipes whose encoding lacks some characters."""

import codecs
from io import TextIOWrapper
from typing import TextIO

_ERRORS = "rigwatch.escaped"


def write_any_text(*streams: TextIO) -> None:
    """Let streams write what their encoding lacks as JSON escapes, which JSON readers undo."""
    codecs.register_error(_ERRORS, _escaped)
    for stream in streams:
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_ERRORS)


def _escaped(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    units = letters.encode("utf-16-be", "surrogatepass").hex()
    escapes = (f"\\u{units[at : at + 4]}" for at in range(0, len(units), 4))
    return "".join(escapes), error.end
