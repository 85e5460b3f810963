"""Hands units to workers, several at a time, and deals with workers that die.

A worker that dies takes all its waiting units with it, and nobody knows which one was at fault. So
a lost unit is submitted again by itself; one that is lost again waits until the end, where it runs
alone in the pool. Only a unit whose worker dies while it runs alone is called its cause, after
`retries` such deaths. Dask tries a lost task again by itself before it reports `KilledWorker`, so
one report about a unit that ran alone is enough.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from itertools import count
from uuid import uuid4

from rigwatch.batch.job import WORKER_DIED, Outcome, unpack
from rigwatch.batch.pool import Pool
from rigwatch.wire.errors import BatchError, one_line

TASK_S = 1.5
"""Intended length of a task: far longer than it takes to hand it over [s]."""
SHORTEST_TASK_S = 0.05
"""Tasks at the end are not shorter: handing one over takes a scheduler, its worker and the client
together some 10 ms of processor time, and waiting for the last one costs no more than this [s]."""
LARGEST_TASK = 512
RETRIES = 3
_LOOK_AGAIN_S = 5.0
Run = Callable[[Sequence[str], str], bytes]


@dataclass(frozen=True, slots=True)
class _Task:
    units: tuple[str, ...]
    generation: int
    alone: bool


class Drive:
    """Work over units on a pool.

    Args:
        pool: the workers.
        run: a function of some paths and of a label that returns their outcomes, packed; sent to
            the workers. The label is never the same: a scheduler may answer a call that it knows
            with what came of it before, even the death of a worker.
        units: paths.
        retries: deaths of workers that a unit running alone may cause before it has failed.
        say: called with remarks for people.
    """

    def __init__(
        self, pool: Pool, run: Run, units: Iterable[str], retries: int, say: Callable[[str], None]
    ) -> None:
        self._pool, self._run, self._retries, self._say = pool, run, retries, say
        self._waiting = deque(units)
        self._again: deque[str] = deque()
        self._suspects: deque[str] = deque()
        self._lost: Counter[str] = Counter()
        self._alone: Counter[str] = Counter()
        self._running: dict[Future[bytes], _Task] = {}
        self._seconds, self._labels = 0.0, (f"{uuid4()}/{number}" for number in count())

    def __iter__(self) -> Iterator[list[Outcome]]:
        """Outcomes as they come; those of a task together, in the order of its units."""
        self._fill()
        while self._running:
            done, _ = wait(self._running, _LOOK_AGAIN_S, FIRST_COMPLETED)
            if not done:
                yield self._forgotten()
            for future in [one for one in self._running if one in done]:
                yield self._collected(future)
            self._fill()

    def _forgotten(self) -> list[Outcome]:
        """Units of tasks that a broken pool lost without reporting them."""
        if not self._pool.workers:
            self._say("no worker is left: waiting for one")
        self._pool.check()
        old = [one for one, t in self._running.items() if t.generation < self._pool.generation]
        lost = [self._running.pop(future) for future in old if not future.done()]
        return [dead for task in lost for dead in self._died(task)]

    def _fill(self) -> None:
        window = 2 * max(1, self._pool.workers)
        while len(self._running) < window and (self._again or self._waiting):
            self._submit(self._next(window), alone=False)
        if not self._running and self._suspects:
            self._submit((self._suspects.popleft(),), alone=True)

    def _next(self, window: int) -> tuple[str, ...]:
        """Units of the next task; towards the end tasks get shorter, so that all workers work."""
        if self._again:
            return (self._again.popleft(),)
        share = max(len(self._waiting) // window, self._in(SHORTEST_TASK_S))
        size = min(share, self._in(TASK_S), LARGEST_TASK, len(self._waiting))
        return tuple(self._waiting.popleft() for _ in range(size))

    def _in(self, seconds: float) -> int:
        """Number of units that take so long, at least one; one while no time is known."""
        return max(1, int(seconds / self._seconds)) if self._seconds else 1

    def _submit(self, units: tuple[str, ...], *, alone: bool) -> None:
        future = self._pool.submit(self._run, units, next(self._labels))
        self._running[future] = _Task(units, self._pool.generation, alone)

    def _collected(self, future: "Future[bytes]") -> list[Outcome]:
        task = self._running.pop(future)
        try:
            outcomes = unpack(future.result())
        except BrokenExecutor:
            self._pool.renew(task.generation)
            return self._died(task)
        except CancelledError:
            raise BatchError("the scheduler is gone or has cancelled the work") from None
        except BatchError:
            raise
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Dask's, which need not be installed
                return self._died(task, self._retries)
            return self._refused(task, error)
        for outcome in outcomes:
            self._measure(outcome.seconds)
        return outcomes

    def _measure(self, seconds: float) -> None:
        self._seconds += 0.2 * (seconds - self._seconds) if self._seconds else seconds

    def _died(self, task: _Task, deaths: int = 1) -> list[Outcome]:
        """Units of a worker that died so many times: those that are given up."""
        dead = []
        for unit in task.units:
            self._lost[unit] += 1
            self._alone[unit] += deaths * task.alone
            if self._alone[unit] >= self._retries:
                dead.append(_dead(unit))
            elif self._lost[unit] > 1:
                self._suspects.append(unit)
            else:
                self._again.append(unit)
        return dead

    def _refused(self, task: _Task, error: Exception) -> list[Outcome]:
        """A task that could not be sent or answered: alone, each unit shows whether it can."""
        if len(task.units) > 1:
            self._again.extend(task.units)
            return []
        text = f"{task.units[0]}: {one_line(error)}"
        return [Outcome(task.units[0], "", b"", type(error).__name__, text)]


def _dead(unit: str) -> Outcome:
    text = f"{unit}: its worker died each time it ran, alone too"
    return Outcome(unit, "", b"", WORKER_DIED, text)
