"""Names of a recorder's files: numbered segments of one folder."""

import re
from pathlib import PurePath

SUFFIX = ".mcap"
_NAME = re.compile(rf"\d{{6}}{re.escape(SUFFIX)}")


def segment_name(number: int) -> str:
    """Name of a folder's segment, from 1 on."""
    return f"{number:06d}{SUFFIX}"


def names_segment(name: str) -> bool:
    """Whether a file of that name is a segment."""
    return _NAME.fullmatch(name) is not None


def is_segment(path: PurePath) -> bool:
    """Whether a file is named like a segment."""
    return names_segment(path.name)
