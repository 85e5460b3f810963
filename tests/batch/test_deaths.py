"""Workers that die: their units are done by others, and one that kills them is named."""

from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

import rigwatch
from rigwatch.batch import drive, executor_on, job_of
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


class Breaking(ProcessPoolExecutor):
    """A pool that breaks while calls are submitted: what it says to each, the last to all others.

    CPython's own does so in a race (gh-94777, gh-109047): a refused process, a forgotten call.
    """

    def __init__(self, *said: Exception | Future) -> None:
        super().__init__(1)
        self._said = [*said]

    def submit(self, fn, /, *args, **kwargs):
        said = self._said.pop(0) if len(self._said) > 1 else self._said[0]
        if isinstance(said, Exception):
            raise said
        return said


BROKEN = BrokenProcessPool("a process terminated abruptly")


@pytest.mark.parametrize("said", [OSError(9, "Bad file descriptor"), Future()], ids=type)
def test_calls_that_a_breaking_pool_refuses_or_forgets_are_submitted_again(
    files, monkeypatch, said
):
    monkeypatch.setattr(drive, "_LOOK_AGAIN_S", 0.1)
    pools = iter([Breaking(said, BROKEN), ProcessPoolExecutor(2)])
    found = rigwatch.map(sizes, [files], executor=lambda: next(pools))
    assert len(list(found)) == COUNT


def test_processes_that_cannot_be_started_end_the_work(files):
    with pytest.raises(OSError, match="Too many open files"):
        rigwatch.map(sizes, [files], executor=lambda: Breaking(OSError(24, "Too many open files")))


def test_a_worker_of_another_version_is_refused(files):
    with pytest.raises(BatchError, match=r"client 0\.0\.1: install the same version"):
        run_units(job_of(sizes), {}, [str(files / "run0001.mcap")], "0.0.1")
