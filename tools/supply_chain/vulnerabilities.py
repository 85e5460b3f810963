"""Compares the locked packages with a stored copy of OSV's database of vulnerabilities, offline.

    python -m tools.supply_chain.vulnerabilities all.zip --sha256 HASH

The copy is the archive that osv.dev offers for PyPI, one JSON file a record; its hash is printed,
and compared if one is given, so that two machines judge by the same copy. The exit code is 1 if a
locked version is affected and 2 if the copy cannot be used.
"""

import argparse
import hashlib
import json
import sys
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion, Version

from tools.supply_chain.licences import LOCKS, Locked, locked

ECOSYSTEM = "PyPI"


class DatabaseError(Exception):
    """The copy of the database cannot be used."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A locked package with a known vulnerability."""

    package: Locked
    record: str
    summary: str


@dataclass(frozen=True, slots=True)
class Database:
    """A copy of the database: its records, its SHA-256, and when the newest of them changed."""

    records: list[dict[str, Any]]
    sha256: str
    newest: str


def read_database(path: Path) -> Database:
    """Read an archive of records.

    Raises:
        DatabaseError: it is no such archive, or has no record of PyPI.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = (name for name in archive.namelist() if name.endswith(".json"))
            records = [json.loads(archive.read(name)) for name in names]
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    except (OSError, zipfile.BadZipFile, ValueError) as error:
        raise DatabaseError(f"{path}: {error}") from error
    if not any(_of_ecosystem(record) for record in records):
        raise DatabaseError(f"{path}: holds no record of {ECOSYSTEM}")
    return Database(records, sha256, max(str(one.get("modified", "")) for one in records))


def findings(packages: Iterable[Locked], records: Iterable[dict[str, Any]]) -> Iterator[Finding]:
    """The records that affect one of the packages; a withdrawn one affects none."""
    by_name: dict[str, list[Locked]] = {}
    for package in packages:
        by_name.setdefault(canonicalize_name(package.name), []).append(package)
    for record in records:
        if "withdrawn" in record:
            continue
        for affected in _of_ecosystem(record):
            for package in by_name.get(canonicalize_name(affected["package"]["name"]), ()):
                if is_affected(package.version, affected):
                    yield Finding(package, record["id"], str(record.get("summary", "")))


def _of_ecosystem(record: dict[str, Any]) -> list[dict[str, Any]]:
    parts: list[dict[str, Any]] = record.get("affected", [])
    return [one for one in parts if one.get("package", {}).get("ecosystem") == ECOSYSTEM]


def is_affected(version: str, affected: dict[str, Any]) -> bool:
    """Whether a version is listed, or lies in a range of versions."""
    if version in affected.get("versions", ()):
        return True
    ranges = (one for one in affected.get("ranges", ()) if one.get("type") == "ECOSYSTEM")
    return any(_in_range(Version(version), one.get("events", ())) for one in ranges)


def _in_range(version: Version, events: Iterable[dict[str, str]]) -> bool:
    """Whether the last event up to the version begins a span of affected versions."""
    steps = sorted((_version(text), kind) for event in events for kind, text in event.items())
    inside = False
    for at, kind in steps:
        if kind == "introduced" and version >= at:
            inside = True
        elif (kind == "fixed" and version >= at) or (kind == "last_affected" and version > at):
            inside = False
    return inside


def _version(text: str) -> Version:
    """A version of an event; one that is none is refused, as what it bounds is then unknown."""
    try:
        return Version(text)
    except InvalidVersion as error:
        raise DatabaseError(str(error)) from error


def main(arguments: list[str] | None = None) -> int:
    """Print what was compared with what, and each finding."""
    parser = argparse.ArgumentParser(prog="python -m tools.supply_chain.vulnerabilities")
    parser.add_argument("database", type=Path, help="osv.dev's archive for PyPI")
    parser.add_argument("--sha256", help="hash that the archive must have")
    given = parser.parse_args(arguments)
    packages = {one for lock in LOCKS for one in locked(lock)}
    try:
        database = read_database(given.database)
        if given.sha256 and given.sha256 != database.sha256:
            raise DatabaseError(f"{given.database}: SHA-256 {database.sha256}, not {given.sha256}")
        found = sorted(findings(packages, database.records), key=lambda one: one.record)
    except DatabaseError as error:
        print(f"vulnerabilities: {error}", file=sys.stderr)
        return 2
    for one in found:
        print(f"{one.package.name} {one.package.version}: {one.record} {one.summary}".rstrip())
    print(f"{len(packages)} locked packages, {len(found)} known vulnerabilities; database of "
          f"{database.newest}, SHA-256 {database.sha256}")  # fmt: skip
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
