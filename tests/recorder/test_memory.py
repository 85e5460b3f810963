"""Recorder, router and witness, which run for a year: few pools, little that garbage waits for."""

import subprocess
import sys
from pathlib import Path

import pytest

from rigwatch.wire.host import few_pools
from tests.bus.rig import CONFIG, TestRig

on_linux = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="pools are those of glibc, memory is in /proc"
)

POOLS_OF_EIGHT_THREADS = """
import contextlib, ctypes, sys, threading
from pathlib import Path
from rigwatch import recorder, router, witness
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.rig_config import load_rig

stop = threading.Event()
with contextlib.suppress(RigwatchError):
    {begin}
barrier = threading.Barrier(9)

def work():
    held = [bytes(2000) for _ in range(100)]
    barrier.wait()
    barrier.wait()

for _ in range(8):
    threading.Thread(target=work).start()
barrier.wait()
c = ctypes.CDLL(None)
c.fopen.restype = ctypes.c_void_p
file = c.fopen(sys.argv[2].encode(), b"w")
c.malloc_info(0, ctypes.c_void_p(file))
c.fclose(ctypes.c_void_p(file))
barrier.wait()
"""
"""The beginning fails, as nothing is there to record or to supervise, but prepares the process."""


@pytest.mark.parametrize(
    "begin",
    [
        "recorder.run(Path('none.toml'), stop)",
        "recorder.run_several([Path('none.toml')], stop)",
        "witness.run(load_rig(sys.argv[1]), stop)",
        "router.run(load_rig(sys.argv[1]), stop)",
    ],
)
@on_linux
def test_threads_share_few_pools(tmp_path: Path, begin: str) -> None:
    config, pools = tmp_path / "rig.toml", tmp_path / "pools.xml"
    text = CONFIG.format(router=1, listen=1, lease=1.0)
    config.write_text(text.replace("tcp/127.0.0.1:1", "nowhere"))
    code = POOLS_OF_EIGHT_THREADS.format(begin=begin)
    subprocess.run([sys.executable, "-c", code, str(config), str(pools)], check=True, timeout=60)
    assert 1 <= pools.read_text().count("<heap nr") <= few_pools.POOLS


OBJECTS_LOOKED_AT = """
import gc, sys, threading, time
from pathlib import Path
from rigwatch import recorder, router, witness
from rigwatch.wire.rig_config import load_rig

stop = threading.Event()

def watch():
    end = time.monotonic() + 30.0
    while not gc.get_freeze_count() and time.monotonic() < end:
        time.sleep(0.05)
    print(gc.get_freeze_count(), len(gc.get_objects()))
    stop.set()

threading.Thread(target=watch).start()
{begin}
"""


every_process = pytest.mark.parametrize(
    "begin",
    [
        "recorder.run(Path(sys.argv[1]), stop)",
        "recorder.run_several([Path(sys.argv[1])], stop)",
        "witness.run(load_rig(sys.argv[1]), stop)",
        "router.run(load_rig(sys.argv[1]), stop)",
    ],
)


def printed(
    program: str, *arguments: Path | str, folder: Path | None = None, timeout: float = 60.0
) -> str:
    """What a program prints, in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=folder, check=True, timeout=timeout, capture_output=True, text=True,
    ).stdout  # fmt: skip


def numbers_from(program: str, *words: str) -> list[int]:
    """The numbers that a program prints, called with some words."""
    return [int(word) for word in printed(program, *words).split()]


def said_by(folder: Path, program: str, begin: str, timeout: float) -> list[str]:
    """The words that a program prints which begins one of the processes."""
    with TestRig(folder) as rig:
        if "router" not in begin:
            rig.router()
        code = program.format(begin=begin)
        return printed(code, rig.path, folder=folder, timeout=timeout).split()


@every_process
def test_what_start_up_made_is_not_looked_at_again(tmp_path: Path, begin: str) -> None:
    settled, looked_at = map(int, said_by(tmp_path, OBJECTS_LOOKED_AT, begin, 60.0))
    assert settled > 10_000
    assert looked_at < settled / 10


TUPLES_KEPT = """
import sys, threading, time
from pathlib import Path
from rigwatch import recorder, router, witness
from rigwatch.wire.host import few_pools
from rigwatch.wire.rig_config import load_rig

few_pools.TIDY_EVERY = 0.3
stop = threading.Event()

def watch():
    while "tidying" not in {{one.name for one in threading.enumerate()}}:
        time.sleep(0.05)
    end, most = time.monotonic() + 45.0, 0
    while most < 1500 and time.monotonic() < end:
        made = [tuple([n] * 19) for n in range(2000)]
        made.clear()
        kept = sys.getallocatedblocks()
        time.sleep(1.0)
        most = max(most, kept - sys.getallocatedblocks())
    print(most)
    stop.set()

threading.Thread(target=watch).start()
{begin}
time.sleep(1.0)
print("tidying" in {{one.name for one in threading.enumerate()}})
"""


@every_process
def test_freed_tuples_are_not_kept_for_months(tmp_path: Path, begin: str) -> None:
    let_go, still_there = said_by(tmp_path, TUPLES_KEPT, begin, 90.0)
    assert int(let_go) >= 1500
    assert still_there == "False", "the thread ends with the process's work"


PASSING_NEEDS = """
import os, random
import rigwatch.witness.process
from rigwatch.wire.host import settle_memory, use_few_pools
from tools.memory_series import memory_kb

use_few_pools()
settle_memory()
before = memory_kb(os.getpid())
for _ in range(20):
    needed = []
    needed = [bytes(random.choice((40, 72, 120, 300, 450))) for _ in range(2500)]
print(round(memory_kb(os.getpid()) - before), sum(map(len, needed)) // 1000)
"""


@on_linux
def test_what_is_needed_for_a_moment_finds_room_that_is_there() -> None:
    grown_kb, needed_kb = numbers_from(PASSING_NEEDS)
    assert needed_kb > 400
    assert grown_kb < needed_kb / 4


NAMES_OF_A_YEAR = """
import os, sys
import rigwatch.recorder.process
from rigwatch.wire.host import settle_memory, use_few_pools
from tools.memory_series import memory_kb

use_few_pools()
settle_memory()
before = memory_kb(os.getpid())
for number in range(30_000):
    sys.intern(f"{number:06d}.mcap")
print(round(memory_kb(os.getpid()) - before))
"""


@on_linux
def test_names_of_files_that_are_gone_take_no_memory() -> None:
    (grown_kb,) = numbers_from(NAMES_OF_A_YEAR)
    assert grown_kb < 150


NAMES_IN_USE = """
import importlib, os, sys
importlib.import_module(sys.argv[1])
import rigwatch.wire.bus.zenoh_transport
from rigwatch.wire.host import settle_memory, use_few_pools
from tools.memory_series import memory_kb

use_few_pools()
settle_memory()
before = memory_kb(os.getpid())
kept = [sys.intern(f"{number:06d}.mcap") for number in range(6_000)]
taken = sum(map(sys.getsizeof, kept)) / 1024
for number in range(400_000):
    sys.intern(f"gone {number}")
print(round(memory_kb(os.getpid()) - before - taken))
"""


@pytest.mark.parametrize(
    "process",
    [
        "rigwatch.recorder.process",
        "rigwatch.router",
        "rigwatch.witness",
        "monitor.process",
        "daq.__main__",
    ],
)
@on_linux
def test_some_thousand_names_more_do_not_double_the_table_of_names(process: str) -> None:
    (grown_kb,) = numbers_from(NAMES_IN_USE, process)
    assert grown_kb < 400


FREED_BETWEEN_OTHERS = """
import os, threading, time
from rigwatch.wire.host import few_pools
from tools.memory_series import memory_kb

few_pools.TIDY_EVERY = 0.2
few_pools.use_few_pools()
few_pools.keep_memory_tidy(threading.Event())
before = memory_kb(os.getpid())
needed = [bytes(20_000) for _ in range(500)]
between = [bytes(1_000) for _ in range(4)]
most = memory_kb(os.getpid()) - before
needed.clear()
end = time.monotonic() + 10.0
while memory_kb(os.getpid()) - before > most / 4 and time.monotonic() < end:
    time.sleep(0.05)
print(round(most), round(memory_kb(os.getpid()) - before), len(between))
"""


@on_linux
def test_pages_between_what_is_kept_are_given_back() -> None:
    most_kb, kept_kb, _ = numbers_from(FREED_BETWEEN_OTHERS)
    assert most_kb > 9_000
    assert kept_kb < most_kb / 4


ACCOUNT = """
import ctypes

class Pools(ctypes.Structure):
    names = "arena", "free", "fast", "maps", "mapped", "most", "held", "used", "unused", "top"
    _fields_ = [(name, ctypes.c_size_t) for name in names]

library = ctypes.CDLL(None)
library.mallinfo2.restype = Pools
"""
"""What the C library says of its memory, as `library.mallinfo2()` of a program that begins so."""


ARRAYS_OF_ALL_LENGTHS = f"""{ACCOUNT}
import numpy as np
from rigwatch.wire.host import settle_memory

settle_memory()
before = library.mallinfo2().used
for length in range(1, 128):
    needed = [np.ones(length) for _ in range(7)]
for length in range(1, 1024):
    needed = [np.ones(length, np.uint8) for _ in range(7)]
print((library.mallinfo2().used - before) // 1000)
"""


@on_linux
def test_arrays_of_new_lengths_find_what_numpy_keeps() -> None:
    (grown_kb,) = numbers_from(ARRAYS_OF_ALL_LENGTHS)
    assert grown_kb < 50


SLABS_OF_A_MONITOR = f"""{ACCOUNT}
import sys
from monitor.process import loop
from rigwatch.wire.bus.slabs import SLAB

def look(*_):
    before, large = library.mallinfo2().mapped, bytes(64 * SLAB)
    del large
    slabs = [bytearray(SLAB) for _ in range(8)]
    print((library.mallinfo2().mapped - before) // SLAB)
    sys.exit()

loop.joined, loop.prepared = look, lambda *_: None
loop.run(sys.argv[1])
"""


@on_linux
def test_slabs_of_a_monitor_have_pages_of_their_own_after_larger_pieces(tmp_path: Path) -> None:
    with TestRig(tmp_path) as rig:
        (apart,) = numbers_from(SLABS_OF_A_MONITOR, str(rig.path))
    assert apart >= 8


@pytest.mark.parametrize(
    "process",
    [
        "rigwatch.recorder.process",
        "rigwatch.recorder.several",
        "rigwatch.witness",
        "rigwatch.router",
    ],
)
def test_a_process_without_kernels_loads_no_compiler(process: str) -> None:
    # With SciPy, which comes with it, 18 MB and a sixth of a second.
    program = f"import sys, {process}; print(int('numba' in sys.modules))"
    assert numbers_from(program) == [0]
