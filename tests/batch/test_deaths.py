"""Workers that die: their units are done by others, and one that kills them is named."""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

import rigwatch
from rigwatch.batch import executor_on, job_of
from rigwatch.batch.job import run_units
from rigwatch.wire.errors import BatchError
from tests.batch.jobs import deadly, make_files, sizes

COUNT = 24


@pytest.fixture
def files(tmp_path: Path) -> Path:
    return make_files(tmp_path / "sessions", COUNT)


def test_a_worker_that_dies_costs_nothing_but_time(files, tmp_path):
    with executor_on("local:2") as executor:
        found = rigwatch.map(deadly, [files], executor=executor, once=str(tmp_path))
    assert len(list(tmp_path.glob("*.died"))) == 5
    assert [value for _, value in found] == list(range(COUNT))


def test_a_pool_that_was_given_is_replaced(files, tmp_path):
    with ProcessPoolExecutor(2) as executor:
        found = rigwatch.map(deadly, [files], executor=executor, once=str(tmp_path))
    assert [value for _, value in found] == list(range(COUNT))


def test_units_that_kill_every_worker_are_named_and_the_rest_is_done(files):
    with executor_on("local:3") as executor:
        found = rigwatch.map(deadly, [files], executor=executor, always="4,17")
    assert found.failed == {"WorkerDied": 2}
    named = [failure.error for failure in found.failures()]
    assert [Path(text.partition(":")[0]).name for text in named] == ["run0004.mcap", "run0017.mcap"]
    assert all("its worker died each time it ran, alone too" in text for text in named)
    assert [value for _, value in found] == [n for n in range(COUNT) if n not in (4, 17)]


def test_a_worker_of_another_version_is_refused(files):
    with pytest.raises(BatchError, match=r"client 0\.0\.1: install the same version"):
        run_units(job_of(sizes), {}, [str(files / "run0001.mcap")], "0.0.1")
