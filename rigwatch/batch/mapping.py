"""`rigwatch.map`: a job over many recordings or studies.

units ─▶ those without a result ─▶ workers ─▶ journal ─▶ results in the order of the paths
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.batch.drive import RETRIES, Drive
from rigwatch.batch.executors import Maker, preload
from rigwatch.batch.expand import Finder, expand, recording_at
from rigwatch.batch.job import Job, Outcome, job_of, pack, run_units
from rigwatch.batch.journal import Journal, check_target, read_outcomes
from rigwatch.batch.pool import Pool
from rigwatch.batch.progress import Progress
from rigwatch.version import __version__


class Results:
    """Outcomes of a run in the order of their paths.

    Attributes:
        file: the file that holds them, and maybe those of other units; None if they are in memory.
        done: number of results.
        failed: number of failures, by the kind of error.
    """

    def __init__(self, journal: Journal, paths: list[str]) -> None:
        self.file = journal.file
        self._paths = frozenset(paths)
        self._kept = None if self.file else list(journal.outcomes(paths))
        found = Counter(journal.kinds(paths))
        self.done = found.pop("", 0)
        self.failed = dict(sorted(found.items()))

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        """Path and result of each unit that has one."""
        for outcome in self.outcomes():
            if not outcome.failed:
                yield outcome.path, msgspec.json.decode(outcome.value)

    def outcomes(self) -> Iterator[Outcome]:
        """All outcomes, failures included."""
        if self._kept is not None:
            yield from self._kept
        elif self.file is not None:
            yield from (one for one in read_outcomes(self.file) if one.path in self._paths)

    def failures(self) -> Iterator[Outcome]:
        """The units without a result."""
        return (outcome for outcome in self.outcomes() if outcome.failed)

    def summary(self) -> str:
        """One line for people, which names the failures by kind."""
        if not self.failed:
            return f"{self.done} done"
        kinds = ", ".join(f"{count} {kind}" for kind, count in self.failed.items())
        return f"{self.done} done, {sum(self.failed.values())} failed: {kinds}"


def map_recordings(
    job: Job | Callable[..., Any],
    recordings: Iterable[Path | str],
    *,
    executor: Executor | Maker | None = None,
    results: Path | str | None = None,
    inside: Finder = recording_at,
    retries: int = RETRIES,
    say: Callable[[str], None] = lambda _: None,
    seen: Callable[[Outcome], None] = lambda _: None,
    **settings: Any,
) -> Results:
    """Run a job on each recording; the results do not depend on the executor or the order.

    Args:
        job: function of a module, called with a recording's path and the settings; its result is
            plain data. Or a `Job`.
        recordings: paths, globs and folders.
        executor: any `concurrent.futures.Executor`, or a function that makes one; None runs the
            job in this process.
        results: file for the results, `.jsonl` or `.parquet`; a run that was stopped continues
            with the units that it lacks, and failed units are tried again.
        inside: units of a folder; by default its recordings, at any depth.
        retries: workers that a unit running alone may kill before it has failed.
        say: called with progress.
        seen: called with each outcome as it comes.
        settings: passed to the job; files are given as `Path`.

    Raises:
        BatchError: nothing to work on, or the work cannot continue; the results so far are kept.
        MissingExtraError: Parquet without pyarrow.
    """
    file = None if results is None else Path(results)
    check_target(file)
    units = expand(recordings, inside)
    return map_units(
        job_of(job),
        units,
        settings,
        executor=executor,
        file=file,
        retries=retries,
        say=say,
        seen=seen,
    )


def map_units(
    wanted: Job,
    units: list[str],
    settings: dict[str, Any],
    *,
    executor: Executor | Maker | None = None,
    file: Path | None = None,
    retries: int = RETRIES,
    say: Callable[[str], None] = lambda _: None,
    seen: Callable[[Outcome], None] = lambda _: None,
) -> Results:
    """`map_recordings` over units that are named already, each once and in the final order."""
    journal = Journal(file, wanted.identity(settings))
    try:
        left = [unit for unit in units if not _is_done(journal, wanted, unit)]
        progress = Progress(len(units), say)
        progress.kept(len(units) - len(left))
        if left:
            with _pool(wanted, executor) as pool:
                run = partial(_run, wanted, settings)
                for outcomes in Drive(pool, run, left, retries, say):
                    journal.add(outcomes)
                    for outcome in outcomes:
                        progress.add(failed=outcome.failed)
                        seen(outcome)
        journal.finish(units)
        return Results(journal, units)
    finally:
        journal.close()


def _is_done(journal: Journal, job: Job, unit: str) -> bool:
    """Whether there is a result of the unit's present content."""
    known = journal.get(unit)
    if known is None or known.failed:
        return False
    try:
        return job.content(job.unit(unit)) == known.content
    except Exception:  # the job itself will say what is wrong
        return False


@contextmanager
def _pool(job: Job, executor: Executor | Maker | None) -> Iterator[Pool]:
    """The workers; those that were made here end with the work, or at once if it fails."""
    preload(getattr(job.call, "__module__", "__main__"))
    pool = Pool(executor)
    try:
        yield pool
    except BaseException:
        pool.abandon()
        raise
    pool.close()


def _run(job: Job, settings: dict[str, Any], paths: tuple[str, ...], _label: str) -> bytes:
    return pack(run_units(job, settings, paths, __version__))
