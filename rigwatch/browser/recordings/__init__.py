"""From files to a new study: inspect, import, combine with a model."""

from rigwatch.browser.recordings.channels import (
    channels_of,
    check_session,
    known_channels,
    recordings_in,
    write_channels,
)
from rigwatch.browser.recordings.file_contents import FileContents, contents_of
from rigwatch.browser.recordings.import_preview import import_preview
from rigwatch.browser.recordings.new_study import (
    Part,
    make_study,
    template_data,
    template_names,
)
from rigwatch.browser.recordings.stories import Story, begin_story, stories
from rigwatch.browser.recordings.uploads import kept_uploads, new_upload
from rigwatch.browser.recordings.visible_files import visible_files

__all__ = [
    "FileContents",
    "Part",
    "Story",
    "begin_story",
    "channels_of",
    "check_session",
    "contents_of",
    "import_preview",
    "kept_uploads",
    "known_channels",
    "make_study",
    "new_upload",
    "recordings_in",
    "stories",
    "template_data",
    "template_names",
    "visible_files",
    "write_channels",
]
