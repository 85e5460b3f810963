"""Session files: MCAP recordings that survive kill -9 and report what is missing.

`SessionWriter` writes, `open_session` opens and salvages, `joined_blocks` decodes many blocks at
once, `edit` trims and recovers, `summary` describes.
"""

from rigwatch.wire.session.edit import (
    Written,
    first_time,
    iso_time,
    recover,
    standing_alarms,
    trim,
)
from rigwatch.wire.session.file_index import topic_counts
from rigwatch.wire.session.losses import Span, without
from rigwatch.wire.session.merging import LARGEST_BLOCK, merge_pending
from rigwatch.wire.session.reader import (
    MERGED_SAMPLES,
    LostSpan,
    Recorded,
    Session,
    open_session,
)
from rigwatch.wire.session.segment import SUFFIX, is_segment, names_segment, segment_name
from rigwatch.wire.session.span import Part, Place, Wanted, read_page
from rigwatch.wire.session.summary import ChannelSummary, DeviceSummary, Summary, summarise
from rigwatch.wire.session.writer import SessionWriter, message_time, run_info

__all__ = [
    "LARGEST_BLOCK",
    "MERGED_SAMPLES",
    "SUFFIX",
    "ChannelSummary",
    "DeviceSummary",
    "LostSpan",
    "Part",
    "Place",
    "Recorded",
    "Session",
    "SessionWriter",
    "Span",
    "Summary",
    "Wanted",
    "Written",
    "first_time",
    "is_segment",
    "iso_time",
    "merge_pending",
    "message_time",
    "names_segment",
    "open_session",
    "read_page",
    "recover",
    "run_info",
    "segment_name",
    "standing_alarms",
    "summarise",
    "topic_counts",
    "trim",
    "without",
]
