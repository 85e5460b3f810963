"""A connection of DuckDB that reads the index of an archive and nothing else."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rigwatch.archive.layout import ALARMS, INDEX, LOSSES, SECONDS, SESSIONS
from rigwatch.archive.store import Store
from rigwatch.wire.errors import ArchiveError, MissingExtraError

_NO_SECONDS = """
    create view seconds as select ''::varchar as name, ''::varchar as unit,
    now()::timestamp as second, 0::integer as count,
    0::double as mean, 0::double as low, 0::double as high,
    ''::varchar as rig, today()::date as day where false
"""


def engine() -> Any:
    """The module `duckdb`.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import duckdb
    except ImportError:
        raise MissingExtraError("duckdb", "archive", "a query of an archive") from None
    return duckdb


@contextmanager
def opened(store: Store, limits: Mapping[str, Any]) -> Iterator[Any]:
    """A connection with the tables as views, locked to the index.

    Args:
        store: the archive.
        limits: settings of DuckDB that bound a query.

    Raises:
        ArchiveError: there is no index, or it cannot be read.
    """
    duckdb = engine()
    there = {file.name for file in store.listed(INDEX)}
    if SESSIONS not in there:
        raise ArchiveError(f"{store.url}: has no index, make one with rigwatch archive index")
    with _named_plainly(store) as address:
        connection = duckdb.connect(":memory:", config=dict(limits))
        try:
            if not store.is_local:
                connection.register_filesystem(store.files)
            for setting in _settings(address):
                connection.execute(f"set {setting}")
            for name, file in (("sessions", SESSIONS), ("alarms", ALARMS), ("losses", LOSSES)):
                source = f"read_parquet({_quoted(address, file)}, hive_partitioning=false)"
                connection.execute(f"create view {name} as from {source}")
            some = any(name.startswith(SECONDS) for name in there)
            connection.execute(_seconds(address) if some else _NO_SECONDS)
            connection.execute("set lock_configuration=true")
            yield connection
        except duckdb.Error as error:
            text = first_line(error).replace(address, store.address(INDEX))
            raise ArchiveError(f"{store.url}: {text}") from None
        finally:
            connection.close()


@contextmanager
def _named_plainly(store: Store) -> Iterator[str]:
    """The address of the index; of a folder by a link, as DuckDB takes marks in names as patterns.

    `[`, `*` and `?` are patterns to it, and a folder `rig=7` above the index is a column.
    """
    if not store.is_local:
        yield store.address(INDEX)
        return
    with TemporaryDirectory(prefix="rigwatch-") as folder:
        link = Path(folder, INDEX)
        link.symlink_to(Path(store.path(INDEX)).resolve())
        yield str(link)


def _settings(address: str) -> Iterator[str]:
    yield f"allowed_directories=[{_quoted(address, INDEX)}]"
    yield "temp_directory=''"
    yield "enable_external_access=false"
    yield "autoinstall_known_extensions=false"
    yield "autoload_known_extensions=false"
    yield "python_enable_replacements=false"
    yield "TimeZone='UTC'"


def _seconds(address: str) -> str:
    files = _quoted(address, f"{SECONDS}/*/*/*.parquet")
    kinds = "hive_partitioning=true, hive_types={'rig': varchar, 'day': date}"
    return f"create view seconds as from read_parquet({files}, {kinds})"


def _quoted(address: str, name: str) -> str:
    """A place in the index, whose address is given, as SQL."""
    return "'" + f"{address}{name.removeprefix(INDEX)}".replace("'", "''") + "'"


def first_line(error: Exception) -> str:
    """What an error says, in one line."""
    return str(error).strip().partition("\n")[0]
