"""Independent work distributed over the cores in threads: compiled loops run side by side."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def cores() -> int:
    """Number of cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1


def shares(count: int) -> list[slice]:
    """Adjacent parts of `count` items, one per core."""
    parts = np.array_split(np.arange(count), max(min(cores(), count), 1))
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts if len(part)]


def on_all_cores(work: Callable[[T], object], items: Sequence[T]) -> None:
    """Call `work` for every item; an error of any call is raised."""
    threads = min(cores(), len(items))
    if threads < 2:
        for item in items:
            work(item)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, items):
            pass
