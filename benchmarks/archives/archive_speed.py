"""An archive: index of 2 000 sessions, a catalogue query, a month of 10⁸ seconds.

`python -m benchmarks.archives.archive_speed SESSIONS RIGS` runs it with other numbers.
"""

import os
import statistics
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.archives.recordings import make_recordings
from rigwatch.archive import Store, ask, index, query
from rigwatch.archive.layout import SECONDS
from rigwatch.archive.second_aggregates import DAY_S, day_name
from rigwatch.archive.tables import write_seconds
from rigwatch.batch import executor_on
from rigwatch.simulated import EPOCH_NS
from tools.benchmark_table import Row, as_text

LENGTH_S = 60
DAYS = 29
NAMES = ("residual", "theta1")
REPEATS = 9
MONTH = """
    select day, sum(mean * count) / sum(count) as level, min(low), max(high), count(*)
    from seconds where rig = 'rig1' and name = 'theta1' group by day order by day
"""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    return measured(100, 2) if quick else measured(2000, 40)


def measured(sessions: int, rigs: int) -> list[Row]:
    """The rows with so many sessions, and so many rigs in the table of seconds."""
    with TemporaryDirectory(prefix="rigwatch-archive-") as name:
        folder = Path(name, "sessions")
        make_recordings(folder, sessions, LENGTH_S, estimates=True)
        store = Store(str(folder))
        rows = [*indexed(store, sessions), catalogue(store, sessions)]
        fill(folder, rigs)
        return [*rows, month(store, rigs)]


def indexed(store: Store, sessions: int) -> list[Row]:
    """The first index on two processes, and one with nothing to do."""
    times = []
    for _ in range(2):
        began = time.perf_counter()
        with executor_on("local:2") as executor:
            found = index(store, executor=executor)
        times.append(time.perf_counter() - began)
    assert found.statuses == {"ok": sessions}
    load = f"load {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores"
    return [
        Row(
            f"archive: index of {sessions} sessions, two processes",
            f"{times[0]:.1f} s",
            "60 s for 2000",
            "",
            f"sessions of {LENGTH_S} s with samples and estimates, 20 rigs; {load}",
            times[0] < 60 * sessions / 2000,
        ),
        Row("archive: the same again, nothing new", f"{times[1]:.2f} s", "", "", "", None),
    ]


def catalogue(store: Store, sessions: int) -> Row:
    """A question to the catalogue, with opening it."""
    times = [_timed(lambda: ask(store, "losses")) for _ in range(REPEATS)]
    median = statistics.median(times)
    return Row(
        f"archive: question to the catalogue of {sessions}",
        f"{median * 1e3:.0f} ms",
        "100 ms",
        "",
        f"`losses`, opening the index included; median of {REPEATS}",
        median < 0.1,
    )


def fill(folder: Path, rigs: int) -> None:
    """Seconds of so many rigs over a month, one file per rig and day."""
    rng = np.random.default_rng(1)
    first = EPOCH_NS // 10**9
    for rig in range(rigs):
        for day in range(DAYS):
            start = first + day * DAY_S
            place = folder / SECONDS / f"rig=rig{rig}" / f"day={day_name(start)}"
            place.mkdir(parents=True, exist_ok=True)
            write_seconds(place / "month.parquet", _day(rng, start))


def _day(rng: np.random.Generator, start: int) -> dict[str, Any]:
    count = DAY_S * len(NAMES)
    mean = rng.normal(size=count)
    return {
        "name": [(name, DAY_S) for name in NAMES],
        "unit": [("N", count)],
        "second": np.tile(np.arange(start, start + DAY_S), len(NAMES)),
        "count": np.full(count, 256, np.int32),
        "mean": mean,
        "low": mean - 1,
        "high": mean + 1,
    }


def month(store: Store, rigs: int) -> Row:
    """One rig's month out of all seconds."""
    times = [_timed(lambda: query(store, MONTH)) for _ in range(REPEATS)]
    median = statistics.median(times)
    total = rigs * DAYS * DAY_S
    return Row(
        f"archive: one rig's month of {total / 1e6:.3g} million seconds",
        f"{median:.2f} s",
        "1 s for 100 million",
        "",
        f"{len(NAMES)} estimates, {rigs} rigs, {rigs * DAYS} files; mean, least and largest of one "
        f"estimate by day; median of {REPEATS}, load {os.getloadavg()[0]:.0f}",
        median < 1.0,
    )


def _timed(call: Any) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


if __name__ == "__main__":
    print(as_text(measured(int(sys.argv[1]), int(sys.argv[2]))))
