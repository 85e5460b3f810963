"""Encoding of a text file: UTF-8, UTF-16 with its mark or without, else that of Western Windows."""

import codecs
from pathlib import Path

from rigwatch.wire.errors import ImportDataError

PART = 1 << 20
BEGINNING = 512
"""Bytes by which UTF-16 is recognised: of a header and numbers every second one is zero."""
_CONTROL = frozenset(range(0x20)) - frozenset(b"\t\n\r\f")


def encoding_of(path: Path) -> str:
    """Encoding of the file; a pipe, which can be read only once, is UTF-8.

    Programs that write a degree sign or an umlaut in one byte use Windows-1252.

    Raises:
        ImportDataError: the file is no text.
        OSError: it cannot be read.
    """
    if not path.is_file():
        return "utf-8-sig"
    decoder = codecs.getincrementaldecoder("utf-8-sig")()
    with path.open("rb") as file:
        begin = file.read(BEGINNING)
        if begin[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
            return "utf-16"
        if unmarked := _utf16_without_mark(begin):
            return unmarked
        file.seek(0)
        utf8 = True
        while part := file.read(PART):
            if utf8:
                utf8 = _decodes(decoder, part)
            if not utf8 and not _CONTROL.isdisjoint(part):
                raise ImportDataError(f"{path}: found bytes that are no text, expected text")
    return "utf-8-sig" if utf8 else "cp1252"


def _utf16_without_mark(begin: bytes) -> str:
    """UTF-16 with its order of bytes; empty for any other text."""
    pairs = len(begin) // 2
    even, odd = (begin[: 2 * pairs][first::2].count(0) for first in (0, 1))
    if not even and odd > pairs / 2:
        return "utf-16-le"
    return "utf-16-be" if not odd and even > pairs / 2 else ""


def _decodes(decoder: codecs.IncrementalDecoder, part: bytes) -> bool:
    try:
        decoder.decode(part)
    except UnicodeDecodeError:
        return False
    return True
