"""Fills the gap that a cut link leaves: from the recordings of the site where the rig stands.

    site          PastServer ◀──Question── PastQuestions        headquarters
    recordings ──▶    └──────Page──────▶        └──▶ BlockStream, Outage ──▶ recording

`PastServer` answers from the sessions of a rig, a bounded page at a time and slowly enough not to
disturb the recording. `BlockStream` puts samples and estimates where they are missing, `Outage`
adds alarms, events and all others; neither has a clock, thread or bus.
"""

from rigwatch.recorder.past.asking import Answer, PastQuestions
from rigwatch.recorder.past.outage import MARGIN_NS, Outage
from rigwatch.recorder.past.pages import Page, Question
from rigwatch.recorder.past.serving import PastServer
from rigwatch.recorder.past.streams import BlockStream, Hole

__all__ = [
    "MARGIN_NS",
    "Answer",
    "BlockStream",
    "Hole",
    "Outage",
    "Page",
    "PastQuestions",
    "PastServer",
    "Question",
]
