"""Checks of the installation and the machine."""

import ctypes
import importlib.metadata
import os
import platform
import re
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from rigwatch.doctor.finding import Finding, judged
from rigwatch.wire.errors import one_line
from rigwatch.wire.host import free_share

OLDEST, NEWEST = (3, 11), (3, 13)
LOW_DISK, NO_DISK = 0.10, 0.02
"""Free share of a disk below which the recorder warns, and below which it is about to stop."""
LATE = 0.004
"""A wake-up later than one sample period at 256 Hz costs latency [s]."""
TIME_ERROR = 5
"""The return value of adjtimex for an unsynchronised clock."""


def check_machine(folder: Path) -> Iterator[Finding]:
    """All checks that need no configuration; `folder` is where recordings go."""
    yield check_python()
    yield from check_packages()
    yield check_kernels()
    yield check_disk(folder)
    yield check_clock()
    yield check_scheduling()


def check_python() -> Finding:
    """Python is a version that the pinned packages support."""
    version = sys.version_info[:2]
    remedy = "make the environment with Python 3.11, 3.12 or 3.13"
    return judged("python", OLDEST <= version <= NEWEST, platform.python_version(), remedy, "warn")


def check_packages() -> Iterator[Finding]:
    """Every required package is installed and recent enough."""
    for requirement in importlib.metadata.requires("rigwatch") or []:
        needed, _, marker = requirement.partition(";")
        match = re.match(r"[A-Za-z0-9._-]+", needed)
        name = match.group() if match else needed
        extra = re.search(r"extra\s*==\s*['\"](\w+)", marker)
        yield _check_package(name, needed.strip(), extra.group(1) if extra else "")


def _check_package(name: str, needed: str, extra: str) -> Finding:
    what = f"package {name}"
    package = f"rigwatch[{extra}]" if extra else needed
    remedy = f"pip install '{package}'"
    try:
        version = importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        text = f"not installed: rigwatch runs without its {extra}" if extra else "not installed"
        return Finding(what, "warn" if extra else "fail", text, remedy)
    lowest = re.search(r">=([0-9.]+)", needed)
    good = lowest is None or _numbers(version) >= _numbers(lowest.group(1))
    return judged(what, good, f"{version}, needs {needed}" if not good else version, remedy)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])


def check_kernels() -> Finding:
    """Numba compiles, and caches what it has compiled."""
    what = "compiled kernels"
    started = time.perf_counter()
    try:
        from rigwatch.doctor.kernel_probe import add_one

        result = add_one(1.0)
    except Exception as error:
        # Any failure inside the compiler becomes one line for the user.
        remedy = "set NUMBA_CACHE_DIR to a folder you may write to, or install numba again"
        return Finding(what, "fail", one_line(error)[:200], remedy)
    cache = Path(str(add_one.stats.cache_path))
    text = f"compiled in {time.perf_counter() - started:.1f} s, kept in {cache}"
    good = result == 2.0 and os.access(cache, os.W_OK)
    return judged(what, good, text, f"make {cache} writable or set NUMBA_CACHE_DIR")


def check_disk(folder: Path) -> Finding:
    """The disk for recordings has room."""
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    free, part = shutil.disk_usage(existing).free, free_share(existing)
    text = f"{free / 1e9:.1f} GB free ({part:.0%}) for recordings in {folder}"
    remedy = "free some space, or name another folder in [recorder]"
    if not os.access(existing, os.W_OK):
        return Finding("disk", "fail", f"{existing} cannot be written to", remedy)
    return judged("disk", part > LOW_DISK, text, remedy, "warn" if part > NO_DISK else "fail")


def check_clock() -> Finding:
    """The system clock, which stamps the samples, is synchronised."""
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(512))
    text = "synchronised" if state != TIME_ERROR else "nothing synchronises the system's clock"
    remedy = "enable systemd-timesyncd or chrony, so that recordings carry the right time"
    return judged("clock", state != TIME_ERROR, text, remedy, "warn")


def check_scheduling(turns: int = 100) -> Finding:
    """How late this machine wakes a process from a sleep of one millisecond."""
    late = []
    for _ in range(turns):
        asleep = time.perf_counter()
        time.sleep(0.001)
        late.append(time.perf_counter() - asleep - 0.001)
    worst = max(late)
    text = f"a sleep of 1 ms ends at most {worst * 1e3:.1f} ms late"
    remedy = "estimates will come late: stop what else runs here"
    return judged("scheduling", worst < LATE, text, remedy, "warn")
