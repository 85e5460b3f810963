"""Replay of many recordings on a real Dask scheduler: speed, overhead, and kills.

`python -m benchmarks.archives.many_recordings COUNT KILLS` runs it with other numbers.
"""

import multiprocessing
import os
import random
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory
from typing import Any

import psutil

from benchmarks.archives.recordings import MODEL, ROOT, make_recordings
from rigwatch.batch import Job, executor_on, map_recordings
from rigwatch.commands.sessions.replay import judged
from tests.batch.cluster import Cluster
from tools.benchmark_table import Row, as_text

SECONDS = 10
IDLE_S = 5.0
LEAST_SPEEDUP, MOST_OVERHEAD = 1.8, 5.0
SETTINGS: dict[str, Any] = {"model": MODEL, "config": None, "start": None, "end": None}
JOB = Job("replay", judged)
CLIENT = """\
import sys
from benchmarks.archives.many_recordings import replay_all
replay_all(sys.argv[1], sys.argv[2], sys.argv[3])
"""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    return measured(200, 5) if quick else measured(10_000, 50)


def measured(count: int, kills: int) -> list[Row]:
    """The rows with so many recordings and kills."""
    with TemporaryDirectory(prefix="rigwatch-many-") as name:
        folder = Path(name)
        files = make_recordings(folder / "sessions", count, SECONDS)
        for path in files[:3]:
            judged(path, **SETTINGS)  # compiled, and in the memory of this process
        before, both = loop(files), side_by_side(files)
        one = on_cluster(folder, 1)
        two = on_cluster(folder, 2)
        # The machine's pace drifts: the runs between two loops are compared with their mean.
        plain, cpu = (mean(times) for times in zip(before, loop(files), strict=True))
        rows = [speedup(count, plain, both, two), overhead(count, plain, cpu, one)]
        return [*rows, killed(folder, count, kills)]


def loop(files: list[Path]) -> tuple[float, float]:
    """Time of a plain loop by the clock, and by the processor [s]."""
    began, cpu = time.perf_counter(), time.process_time()
    for path in files:
        judged(path, **SETTINGS)
    return time.perf_counter() - began, time.process_time() - cpu


def side_by_side(files: list[Path]) -> float:
    """Time of two plain loops at once, each over half: what the machine itself allows [s]."""
    spawn = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        pools = [stack.enter_context(ProcessPoolExecutor(1, spawn)) for _ in range(2)]
        for pool in pools:
            pool.submit(loop, files[:3]).result()
        began = time.perf_counter()
        halves = [pool.submit(loop, files[k::2]) for k, pool in enumerate(pools)]
        for half in halves:
            half.result()
        return time.perf_counter() - began


def on_cluster(folder: Path, workers: int) -> tuple[float, float, float]:
    """Time with so many workers by the clock and by the workers' processors [s]; share when idle.

    A worker that has nothing to do keeps a few hundredths of a core busy.
    """
    place = folder / f"cluster{workers}"
    place.mkdir()
    with Cluster(place, workers) as cluster, executor_on(cluster.address) as executor:
        warm = [str(path) for path in sorted((folder / "sessions").iterdir())[: 4 * workers]]
        map_recordings(JOB, warm, executor=executor, **SETTINGS)
        before = _cpu(cluster)
        time.sleep(IDLE_S)
        idle = (_cpu(cluster) - before) / IDLE_S
        before = _cpu(cluster)
        began = time.perf_counter()
        target = place / "results.jsonl"
        map_recordings(JOB, [folder / "sessions"], executor=executor, results=target, **SETTINGS)
        return time.perf_counter() - began, _cpu(cluster) - before, idle


def _cpu(cluster: Cluster) -> float:
    times = [process.cpu_times() for process in cluster.workers()]
    return sum(one.user + one.system for one in times)


def speedup(count: int, plain: float, both: float, two: tuple[float, float, float]) -> Row:
    """Two workers against the loop; two loops side by side tell how far the machine lets them."""
    factor = plain / two[0]
    return Row(
        f"{count} recordings of {SECONDS} s: Dask, 2 workers",
        f"{factor:.2f} × a plain loop",
        f"≥ {LEAST_SPEEDUP} ×",
        "",
        f"by the clock {plain:.0f} s → {two[0]:.0f} s, load {os.getloadavg()[0]:.0f} on "
        f"{os.cpu_count()} cores; the workers' processors took {two[1]:.0f} s; two plain loops "
        f"side by side are {plain / both:.2f} × as fast as one",
        factor >= LEAST_SPEEDUP,
    )


def overhead(count: int, plain: float, cpu: float, one: tuple[float, float, float]) -> Row:
    """What one worker takes more than the loop, by the processor's time.

    Other load on the machine lengthens the run, and with it what the worker spends idle: that
    counts for the time of the work alone.
    """
    wall, took, idle = one
    more = 100 * ((took - idle * max(0.0, wall - cpu)) / cpu - 1)
    return Row(
        f"{count} recordings: overhead of one Dask worker",
        f"{more:.1f} %",
        f"< {MOST_OVERHEAD:.0f} %",
        "",
        f"processor's time of worker {took:.0f} s and of loop {cpu:.0f} s; by the clock "
        f"{wall:.0f} s and {plain:.0f} s; an idle worker takes {100 * idle:.1f} % of a core, "
        "counted for the time of the loop",
        more < MOST_OVERHEAD,
    )


def replay_all(folder: str, target: str, where: str) -> None:
    """What the client that is killed does."""
    with executor_on(where) as executor:
        map_recordings(JOB, [folder], executor=executor, results=target, **SETTINGS)


def killed(folder: Path, count: int, kills: int) -> Row:
    """Workers killed at random moments, the client once: the same bytes."""
    target, place = folder / "killed.jsonl", folder / "kills"
    place.mkdir()
    moments, done = random.Random(1), 0
    with Cluster(place, 2) as cluster:
        client = _client(folder, target, cluster.address)
        while done < kills or client.poll() is None:
            time.sleep(moments.uniform(0.2, 2.0))
            if client.poll() is not None and done < kills:
                target.unlink()  # finished before the last kill: once more
                client = _client(folder, target, cluster.address)
            if done < kills and (workers := cluster.workers()):
                with suppress(psutil.Error):
                    moments.choice(workers).kill()
                    done += 1
            if done == kills // 2 and client.poll() is None:
                client.kill()
                client.wait()
                done += 1
                client = _client(folder, target, cluster.address)
    same = target.read_bytes() == (folder / "cluster2" / "results.jsonl").read_bytes()
    lines = target.read_bytes().count(b"\n")
    return Row(
        f"{count} recordings, {done - 1} workers and the client killed",
        f"{'byte-identical' if same else 'differs'}, {lines} results",
        "byte-identical, none missing or twice",
        "",
        "SIGKILL at random moments; compared with the file of a run without kills",
        same and lines == count,
    )


def _client(folder: Path, target: Path, where: str) -> "subprocess.Popen[bytes]":
    arguments = [str(folder / "sessions"), str(target), where]
    command = [sys.executable, "-c", CLIENT, *arguments]
    return subprocess.Popen(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})


if __name__ == "__main__":
    print(as_text(measured(int(sys.argv[1]), int(sys.argv[2]))))
