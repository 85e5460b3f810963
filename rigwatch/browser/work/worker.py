"""A study's process: runs tasks from a pipe, reports progress and results, ends with its parent."""

from multiprocessing.connection import Connection
from pathlib import Path

from rigwatch.browser.work.tasks import TASKS, Worker
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import end_with_parent


def work(pipe: Connection, folder: str) -> None:
    """Execute tasks from the pipe, one after another, until it is closed."""
    end_with_parent()
    worker = Worker(
        Path(folder),
        lambda text: pipe.send(("progress", text)),
        lambda: pipe.send(("shown", None)),
    )
    while True:
        try:
            task, arguments = pipe.recv()
        except EOFError:
            return
        pipe.send(_outcome(worker, task, arguments))


def _outcome(worker: Worker, task: str, arguments: dict[str, object]) -> tuple[str, object]:
    try:
        return "done", TASKS[task](worker, **arguments)
    except RigwatchError as error:
        return "failed", str(error)
    except Exception as error:
        return "failed", f"{task}: {type(error).__name__}: {error}"
