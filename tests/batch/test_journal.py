"""The file of results while they come."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigwatch.batch import Outcome
from rigwatch.batch.journal import Journal, as_line
from rigwatch.wire.errors import BatchError

WORK, COUNT = "0" * 64, 400


def _results(count: int) -> list[Outcome]:
    return [Outcome(f"run{number:04d}.mcap", "f" * 64, b"1") for number in range(count)]


def _write(file: Path, groups: list[list[Outcome]]) -> None:
    journal = Journal(file, WORK)
    try:
        for outcomes in groups:
            journal.add(outcomes)
    finally:
        journal.close()


@contextmanager
def _files_end_at(size: int) -> Iterator[None]:
    """No file of this process grows further: writing to it fails as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("together", [1, 3, COUNT])
def test_a_disk_that_is_full_is_reported_and_every_whole_line_is_kept(tmp_path, together):
    file, outcomes = tmp_path / "out.jsonl", _results(COUNT)
    groups = [outcomes[start : start + together] for start in range(0, COUNT, together)]
    size = 100 * len(as_line(outcomes[0], WORK)) + 10
    with _files_end_at(size), pytest.raises(BatchError, match="cannot be written"):
        _write(file, groups)
    again = Journal(file, WORK)
    try:
        assert list(again.outcomes(outcome.path for outcome in outcomes)) == outcomes[:100]
    finally:
        again.close()
