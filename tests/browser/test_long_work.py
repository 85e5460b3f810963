"""Long work on a study: heard of, cancelled within a second, killed; files are as they were."""

import asyncio
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.forkserver import _forkserver
from pathlib import Path
from threading import Timer

import pytest

from rigwatch.browser.work.desk import BusyError, Desk, Desks
from rigwatch.browser.work.results import FOLDER, results_of
from rigwatch.browser.work.study_process import warm_up
from rigwatch.workbench.study.folder import FILE
from rigwatch.workbench.study.ledger import lines
from rigwatch.workbench.study.study import open_study
from tests.waiting import PATIENCE
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = studied(tmp_path_factory.mktemp("work"), WAVES, [waves(0)], [waves(1)], UNITS)
    return made.folder


@pytest.fixture(scope="module", autouse=True)
def engine() -> None:
    """The process that the others are made of, with the engine in it, as the server has one."""
    warm_up()


@pytest.fixture
def desk(folder: Path) -> Iterator[Desk]:
    found = Desk(folder)
    yield found
    found.close()


def files(folder: Path) -> dict[str, bytes]:
    """The study's own files, without the results that are kept beside them."""
    whole = (path for path in folder.rglob("*") if path.is_file() and FOLDER not in path.parts)
    return {str(path): path.read_bytes() for path in whole}


async def until(holds: Callable[[], object], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, what
        await asyncio.sleep(0.005)


async def done(desk: Desk, task: str, **arguments: object) -> str:
    job = desk.ask(task, arguments)
    await until(lambda: desk.job and desk.job.number >= job.number and not desk.job.active, task)
    assert desk.job is not None
    return desk.job.state


def test_progress_is_received_and_a_second_task_is_refused_meanwhile(desk: Desk) -> None:
    async def story() -> None:
        queue = desk.listeners.listen()
        desk.ask("explain", {})
        with pytest.raises(BusyError, match="busy with explain"):
            desk.ask("undo", {})
        told: set[str] = set()

        def ended() -> bool:
            assert desk.job is not None
            told.add(desk.job.text)
            return not desk.job.active

        await until(ended, "explain")
        assert desk.job is not None
        assert desk.job.state == "done", desk.job.text
        assert any(text.startswith("fitting ") for text in told)
        assert not queue.empty()
        kept = results_of(open_study(desk.folder))
        assert kept.read("explanation")["ranking"]
        assert kept.read("evidence")

    asyncio.run(story())


@contextmanager
def busy_fork_server() -> Iterator[Timer]:
    """While it still loads the engine; it goes on in the end, also for who waits for it."""
    server = vars(_forkserver)["_forkserver_pid"]
    os.kill(server, signal.SIGSTOP)
    patience = Timer(2.0, os.kill, (server, signal.SIGCONT))
    patience.start()
    try:
        yield patience
    finally:
        patience.cancel()
        os.kill(server, signal.SIGCONT)


def test_nobody_waits_for_a_process_to_start_and_it_can_be_cancelled_before(desk: Desk) -> None:
    async def story() -> None:
        with busy_fork_server() as server:
            desk.ask("explain", {})
            starting = desk._process
            assert desk.cancel()
            desk.ask("show", {})
            assert server.is_alive(), "waited for the fork server"
        assert starting is not None
        await until(lambda: starting.pid and not starting.is_alive(), "the end of the cancelled")
        await until(lambda: desk.job and not desk.job.active, "the task that came after it")
        assert desk.job is not None
        assert (desk.job.task, desk.job.state) == ("show", "done")

    asyncio.run(story())


def test_cancel_ends_it_and_leaves_the_files(desk: Desk) -> None:
    async def story() -> None:
        assert await done(desk, "show") == "done"
        before = files(desk.folder)
        desk.ask("add", {"effect": "constant_force", "port": "load"})
        await until(lambda: desk.job and desk.job.text.startswith("fitting"), "a fit")
        process = desk._process
        assert desk.cancel()
        assert process is not None
        await until(lambda: not process.is_alive(), "the end of the process")
        assert files(desk.folder) == before
        assert desk.job is not None
        assert desk.job.state == "cancelled"
        assert not desk.cancel()
        # And it goes on from there.
        assert await done(desk, "add", effect="constant_force", port="load") == "done"
        assert await done(desk, "undo") == "done"
        assert [line["step"] for line in lines(open_study(desk.folder))] == ["new", "add", "undo"]

    asyncio.run(story())


def test_a_process_that_is_killed_is_reported_and_replaced(desk: Desk) -> None:
    async def story() -> None:
        assert await done(desk, "show") == "done"
        before = files(desk.folder)
        desk.ask("preview", {"effect": "linear_stiffness", "port": "load"})
        assert desk._process is not None
        assert desk._process.pid is not None
        os.kill(desk._process.pid, signal.SIGKILL)
        await until(lambda: desk.job and not desk.job.active, "the end")
        assert desk.job is not None
        assert desk.job.state in ("failed", "done")
        assert files(desk.folder) == before
        assert await done(desk, "preview", effect="linear_stiffness", port="load") == "done"

    asyncio.run(story())


def test_the_engines_sentence_is_reported(desk: Desk) -> None:
    async def story() -> None:
        assert await done(desk, "add", effect="strebeck", port="load") == "failed"
        assert desk.job is not None
        assert "did you mean 'stribeck'" in desk.job.text

    asyncio.run(story())


def test_a_change_elsewhere_is_told_to_who_looks(desk: Desk) -> None:
    async def story() -> None:
        desks = Desks()
        watched = desks.of(desk.folder)
        queue = watched.listeners.listen()
        stat = (desk.folder / FILE).stat

        watching = asyncio.create_task(desks.watch(lambda _: stat().st_mtime_ns, 0.01))

        def told() -> bool:
            os.utime(desk.folder / FILE)
            return not queue.empty()

        await until(told, "a change of the file")
        assert queue.get_nowait()[0] == "study"
        watching.cancel()
        desks.close()

    asyncio.run(story())


def test_a_disk_that_keeps_the_look_at_a_study_waiting_keeps_no_page_waiting(
    tmp_path: Path,
) -> None:
    disk, reading, waited = threading.Event(), threading.Event(), []

    def state(_: Path) -> int:
        reading.set()
        waited.append(not disk.wait(2.0))
        return 0

    async def story() -> None:
        desks = Desks()
        desks.of(tmp_path).listeners.listen()
        watching = asyncio.create_task(desks.watch(state, 60.0))
        await until(reading.is_set, "the look at the study")
        disk.set()  # in its turn only if the loop, which answers pages, goes on meanwhile
        await until(lambda: bool(waited), "the disk")
        watching.cancel()
        desks.close()

    asyncio.run(story())
    assert waited == [False]
