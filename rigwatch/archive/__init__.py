"""A catalogue of many sessions, and figures of their estimates per second, for questions in SQL.

    sessions ─▶ index (only new and changed ones are read) ─▶ Parquet ─▶ DuckDB, Polars, Spark, …

An archive is a folder, or a place in an object store, with sessions at any depth. Its index lies
in it, in the folder `rigwatch-index`. `Anywhere` lets a job over recordings read those of an object
store.
"""

from rigwatch.archive.contents import Shown, show
from rigwatch.archive.indexing import Indexed, index
from rigwatch.archive.query import Answer, Bounds, ask, query
from rigwatch.archive.questions import QUESTIONS, Question
from rigwatch.archive.recordings import Anywhere, content_anywhere, sessions_at
from rigwatch.archive.retention.oldest import Thinned, thin_oldest
from rigwatch.archive.retention.retain import Retained, retain
from rigwatch.archive.store import Store

__all__ = [
    "QUESTIONS",
    "Answer",
    "Anywhere",
    "Bounds",
    "Indexed",
    "Question",
    "Retained",
    "Shown",
    "Store",
    "Thinned",
    "ask",
    "content_anywhere",
    "index",
    "query",
    "retain",
    "sessions_at",
    "show",
    "thin_oldest",
]
