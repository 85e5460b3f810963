"""Independent work with equations and simulations, side by side in threads.

SymPy is not made for several threads at once, so the threads take turns: one at a time runs Python,
and gives its turn to the others while compiled code works, which is most of the time of a fit. The
results are those of one thread, in the order of the items.
"""

import contextvars
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock, local
from typing import TypeVar

from rigwatch.physics.engine.compile.all_cores import cores

T = TypeVar("T")
R = TypeVar("R")
_TURN = Lock()
_THIS = local()


def side_by_side(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """The results of `work` for every item, in order; the error of the first that fails is raised.

    Within `work` another call runs its items in turn.
    """
    threads = min(cores(), len(items))
    if threads < 2 or _has_turn():
        return [work(item) for item in items]

    def one(context: contextvars.Context, item: T) -> R:
        with _TURN:
            _THIS.turn = True
            try:
                return context.run(work, item)
            finally:
                _THIS.turn = False

    # NumPy's handling of floating-point errors belongs to the context of the caller.
    contexts = [contextvars.copy_context() for _ in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, contexts, items))


@contextmanager
def turn_given() -> Iterator[None]:
    """Other threads of `side_by_side` may run Python meanwhile; nothing elsewhere."""
    if not _has_turn():
        yield
        return
    _THIS.turn = False
    _TURN.release()
    try:
        yield
    finally:
        _TURN.acquire()
        _THIS.turn = True


@contextmanager
def alone(lock: Lock) -> Iterator[None]:
    """Holds a lock, which is waited for without a turn: its holder may need one."""
    with turn_given():
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def together(*works: Callable[[], R]) -> list[R]:
    """The results of different calls, side by side."""
    return side_by_side(lambda work: work(), works)


def _has_turn() -> bool:
    return getattr(_THIS, "turn", False)
