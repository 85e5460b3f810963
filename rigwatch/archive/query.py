"""SQL over the index, read-only and bounded.

DuckDB runs in this process, on the tables `sessions`, `alarms`, `losses` and `seconds`. One
statement that selects is accepted; it reads no file outside of the index, loads no extension and
changes no setting, and its memory, time and rows are bounded.
"""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from rigwatch.archive.connection import engine, first_line, opened
from rigwatch.archive.questions import COUNTS_BACK, QUESTIONS
from rigwatch.archive.store import Store
from rigwatch.wire.errors import ArchiveError, nearest

MOST_RIGS = 100_000
"""Rigs of an archive that a question counts back for."""
_BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)
_END = datetime(9999, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits of a query.

    Attributes:
        rows: most rows of an answer.
        seconds: longest time [s].
        memory_mb: most memory [MB].
        threads: most threads.
    """

    rows: int = 1000
    seconds: float = 60.0
    memory_mb: int = 2000
    threads: int = 4


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to a query.

    Attributes:
        columns: names.
        rows: values.
        more: whether there are more rows than allowed.
    """

    columns: list[str]
    rows: list[tuple[Any, ...]]
    more: bool

    def as_dicts(self) -> list[dict[str, Any]]:
        """The rows by column."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]


def query(
    store: Store,
    sql: str,
    parameters: Mapping[str, Any] | None = None,
    bounds: Bounds | None = None,
) -> Answer:
    """The answer to an SQL query.

    Raises:
        ArchiveError: there is no index, the query is wrong, is no single selection, or exceeds a
            bound.
        MissingExtraError: DuckDB is not installed.
    """
    bounds = bounds or Bounds()
    duckdb = engine()
    limits = {"memory_limit": f"{bounds.memory_mb}MB", "threads": bounds.threads}
    with opened(store, limits) as connection:
        _check(duckdb, connection, sql)
        late = threading.Timer(bounds.seconds, connection.interrupt)
        late.start()
        try:
            done = connection.execute(sql, dict(parameters or {}))
            rows = done.fetchmany(bounds.rows + 1)
            columns = [column[0] for column in done.description]
        except duckdb.InterruptException:
            text = f"query: took more than {bounds.seconds:g} s"
            raise ArchiveError(f"{text}, expected a narrower one") from None
        except duckdb.Error as error:
            raise ArchiveError(f"query: {first_line(error)}") from None
        finally:
            late.cancel()
    return Answer(columns, rows[: bounds.rows], len(rows) > bounds.rows)


def ask(
    store: Store,
    name: str,
    *,
    rig: str = "%",
    since: datetime | None = None,
    until: datetime | None = None,
    bounds: Bounds | None = None,
) -> Answer:
    """The answer to a question of `QUESTIONS`.

    Args:
        store: the archive.
        name: the question.
        rig: name of a rig, or a pattern with %.
        since, until: span of time; by default all. A question that counts back from `until` does
            so from the end of each rig's last session.
        bounds: what it may take.

    Raises:
        ArchiveError: no question has this name, or as in `query`.
    """
    if name not in QUESTIONS:
        raise ArchiveError(f"query: no question {name!r}{nearest(name, QUESTIONS)}")
    sql = QUESTIONS[name].sql
    pattern = rig.replace("!", "!!").replace("_", "!_")
    times = {"since": since or _BEGINNING, "until": until or _END}
    given: dict[str, Any] = {"rig": pattern} | {name: _plain(t) for name, t in times.items()}
    if COUNTS_BACK in sql:
        given |= _ends(store, pattern, until)
    return query(store, sql, {k: v for k, v in given.items() if f"${k}" in sql}, bounds)


def _plain(time: datetime) -> datetime:
    """A time as the tables have it: UTC, without a zone."""
    return time.astimezone(UTC).replace(tzinfo=None)


def _ends(store: Store, pattern: str, until: datetime | None) -> dict[str, Any]:
    """Given to a question that counts back: of each rig, `until` or the end of its sessions."""
    sql = (
        'select rig, max("end") + interval 1 second from sessions'
        " where rig like $rig escape '!' and \"end\" is not null group by rig"
    )
    found = query(store, sql, {"rig": pattern}, Bounds(rows=MOST_RIGS)).rows
    ends = [_plain(until) if until else end for _, end in found]
    extremes = {"first": min(ends, default=_plain(_END)), "last": max(ends, default=_plain(_END))}
    return {"names": [name for name, _ in found], "ends": ends} | extremes


def _check(duckdb: Any, connection: Any, sql: str) -> None:
    """Raise unless the text is one statement that selects."""
    try:
        statements = connection.extract_statements(sql)
    except duckdb.Error as error:
        raise ArchiveError(f"query: {first_line(error)}") from None
    if [statement.type for statement in statements] != [duckdb.StatementType.SELECT]:
        kinds = ", ".join(statement.type.name for statement in statements) or "nothing"
        raise ArchiveError(f"query: found {kinds}, expected one SELECT")
