"""What loggers write into text files: their encoding, header and units, dates and times of day."""

from rigwatch.wire.texts.csv_head import DELIMITERS, HEAD, Head, found_head, is_number
from rigwatch.wire.texts.encodings import encoding_of
from rigwatch.wire.texts.headers import Header, read_header
from rigwatch.wire.texts.written_times import TimeStyle, past_midnight, time_style

__all__ = [
    "DELIMITERS",
    "HEAD",
    "Head",
    "Header",
    "TimeStyle",
    "encoding_of",
    "found_head",
    "is_number",
    "past_midnight",
    "read_header",
    "time_style",
]
