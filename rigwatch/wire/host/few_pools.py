"""Memory of a process that runs for a year: in few pools, and large pieces given back at once.

The C library gives each thread a pool of its own, sixteen in a process on the bus, and each grows
to the most that its threads ever needed at a time. A large piece freed once also makes it take
later ones from the pools, which they leave full of holes.

Python looks for cycles among old objects only once a quarter as many new ones wait, and start-up
makes forty thousand: garbage of months would wait for that, in arenas that are never given back.

It also keeps up to two thousand freed tuples of each length, which a process that decodes messages
gathers over months: half a megabyte to one. Only a collection of the old objects lets go of them.

Python's own arenas, a megabyte each, are full after start-up: a passing need of some kilobytes
takes another one, which fills over weeks and stays. Its room is taken at the start instead.

Numpy keeps up to seven freed arrays of each size below a kilobyte, 4 MB in all. Blocks of ever new
lengths come for months, and the flags of each leave one: all are made at the start.

Python keeps a table of names, of which every new file's is one. The place of a name that is gone is
not used again until the table is full: then it is made anew, with three places for each name in
use, rounded up to a power of two. A start leaves so many in use that a few thousand more double the
table, by one megabyte in a recorder and by two in a monitor: in a year of recordings they did so in
its autumn. So some names stay in use from the start, and the table is filled.

Pieces that are freed between others stay with the process as well: the library gives back only what
is free at the end of a pool, unless it is asked for all pages that hold nothing.
"""

import contextlib
import ctypes
import gc
import sys
import threading

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8
"""Options of mallopt(3)."""
POOLS = 2
LARGE = 1 << 17
"""Size from which a piece has pages of its own [bytes]; the library's, which otherwise grows."""
ROOM, SMALL = 1 << 20, 460
"""Room in Python's arenas beyond what start-up needs, and the objects that take it for a moment, of
the largest kind that arenas hold [bytes].
"""
ARRAYS, OF_EACH = range(1, 1024), 7
"""Sizes of arrays that numpy keeps [bytes]; number of each."""
_kept: list[bytes] = []
"""One of them: an arena without any would be given back."""
_names: list[str] = []
NAMES_KEPT, NAMES = 14_000, 1 << 18
"""Names that stay in use: with them no process is near a limit, as the table doubles with 2 to 11
thousand after a start and then with 24 and more. Names that fill it, more than it has places."""
TIDY_EVERY = 60.0
"""Time between two collections of everything [s]; with few new objects one takes under 1 ms."""
_NO_GLIBC = (AttributeError, OSError, TypeError)
"""What calling the C library raises where it is not glibc."""


def use_few_pools() -> None:
    """Set this up before threads are started; without effect where the library is not glibc."""
    _set(_ARENA_MAX, POOLS)
    keep_large_pieces_apart()


def keep_large_pieces_apart() -> None:
    """Give large pieces pages of their own, whatever was freed before; all of `use_few_pools` for a
    process whose threads must not wait for each other's memory.
    """
    _set(_MMAP_THRESHOLD, LARGE)
    _set(_TRIM_THRESHOLD, LARGE)


def _set(option: int, value: int) -> None:
    with contextlib.suppress(*_NO_GLIBC):
        ctypes.CDLL(None).mallopt(option, value)


def settle_memory() -> None:
    """Collect what start-up has left; call it once, after all set-up, before the loop.

    Objects that exist now are never examined again, so that later collections are short and come
    as often as new garbage asks for.
    """
    gc.collect()
    if not _kept:
        _fill_table_of_names()
        _fill_cache_of_arrays()
        # Last, as what has been kept before has taken of the arenas' room.
        _kept.append([bytes(SMALL) for _ in range(ROOM // SMALL)][-1])
    gc.freeze()


def _fill_cache_of_arrays() -> None:
    # Commands that only print their help import this module, and must not wait for numpy.
    import numpy as np

    for size in ARRAYS:
        _made = [np.ones(size, np.uint8) for _ in range(OF_EACH)]


def _fill_table_of_names() -> None:
    _names.extend(sys.intern(f"kept {number}") for number in range(NAMES_KEPT))
    for number in range(NAMES):
        sys.intern(f"name {number}")


def keep_memory_tidy(stop: threading.Event) -> None:
    """Settle the memory, and tidy it until `stop` is set."""
    settle_memory()
    tidy_memory(stop)


def tidy_memory(stop: threading.Event) -> None:
    """Collect garbage and empty pages once a minute until `stop` is set, in a thread of its own.

    For processes in which a pause of a millisecond does not matter.
    """
    threading.Thread(target=_tidy, args=(stop,), name="tidying", daemon=True).start()


def _tidy(stop: threading.Event) -> None:
    while not stop.wait(TIDY_EVERY):
        gc.collect()
        with contextlib.suppress(*_NO_GLIBC):
            ctypes.CDLL(None).malloc_trim(0)
