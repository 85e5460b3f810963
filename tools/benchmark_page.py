"""The newest figures of every benchmark, kept in `results.json`, and the page made of them.

    make bench ──rows──▶ results.json ──page──▶ docs/benchmarks.md

A run replaces the rows of the benchmarks that it ran, and leaves those of the others as they are.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import msgspec

from tools.benchmark_table import Row, as_markdown, ran

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results.json"
PAGE = ROOT / "docs" / "benchmarks.md"

SECTIONS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    (
        "Watching a rig",
        "The simulated servo-pneumatic rig with the seven excitations of the thesis's Table 5.2, "
        "and rigs, drives and faults on which nothing was tuned.",
        (
            "numerical_validation",
            "experiments",
            "false_alarms",
            "other_faults",
            "unseen_faults",
            "wrong_drives",
            "aperiodic",
            "detectors",
            "probable_cause",
            "emps",
        ),
    ),
    (
        "Processes and recordings",
        "Real processes, a real serial line and a real router on one machine. Latency needs the "
        "real-time scheduling class (root, `LimitRTPRIO`, or the compose file's `ulimits`); "
        "without it, p99 grows to tens of milliseconds on a machine that is busy with other work.",
        (
            "latency",
            "notification",
            "random_kills",
            "a_year",
            "rogue_client",
            "bombs",
            "fuzzing",
            "fuzzed_requests",
            "fuzzed_viewer",
            "replay",
            "windowed_least_squares",
        ),
    ),
    (
        "Many recordings and archives",
        "A real Dask scheduler with worker processes, and an index in a folder: "
        "[archive](archive.md).",
        ("many_recordings", "archive_speed"),
    ),
    (
        "Explaining a recording",
        "Effects hidden in simulated plants whose equations and integrators are not those of the "
        "models. What was hidden and what it was called: [hidden effects](hidden-effects.md).",
        (
            "hidden_effects",
            "held_inputs",
            "hidden_rivals",
            "chains",
            "user_logs",
            "own_machines",
            "hidden_effects_rig",
            "rig_intervals",
            "multi_start_fits",
            "next_experiment",
            "explain_speed",
            "simulation_speed",
        ),
    ),
    (
        "Rigs that nobody here built",
        "Rigs simulated by people who had not read the estimator, and random rigs whose equations "
        "are held out, played through the commands. A letter is a kind of rig. `earlier_rigs` was "
        "measured with earlier code, and not again.",
        ("independent_rigs", "earlier_rigs", "along_calibration"),
    ),
    (
        "The workbench in a browser",
        "A headless Chromium that draws without a graphics processor, the real server, and five "
        "and a half hours of the simulated rig at 256 Hz, fitted for real.",
        ("browser_speed", "browser_bounds", "browser_kills"),
    ),
    (
        "Structures",
        "The Kabe antenna of the thesis's chapter 4. More figures: [damage](structure-damage.md).",
        ("structures", "structure_damage"),
    ),
)
HEAD = """<!-- Printed by `make bench` from benchmarks/results.json. -->

# Benchmarks

`make bench` runs every benchmark and writes this page; `make bench BENCH="latency replay"` runs
two of them and keeps the figures of the others. "Published" is W. B. Dunbar's thesis of 1999
unless a row says otherwise; "MISS" marks a figure that misses its bar. Linux and Python 3.11;
"load" is the machine's load average, other work included.
"""


class Measured(msgspec.Struct, frozen=True, kw_only=True):
    """The newest figures of one benchmark.

    Attributes:
        command: what measures them.
        machine: what they were measured on, as `benchmarks.__main__.machine` gives it.
        rows: the results.
    """

    command: str
    machine: dict[str, str]
    rows: list[Row]


def read(path: Path = RESULTS) -> dict[str, Measured]:
    """The newest figures by benchmark."""
    return msgspec.json.decode(path.read_bytes(), type=dict[str, Measured])


def keep(
    found: Mapping[str, list[Row]], machine: dict[str, str], path: Path = RESULTS
) -> dict[str, Measured]:
    """Put the rows of the benchmarks that ran into the file `path`; all that it then holds.

    A benchmark that failed leaves its earlier rows as they are.
    """
    results = read(path) if path.is_file() else {}
    for name, rows in found.items():
        if ran(rows):
            command = f"python -m benchmarks {name}"
            results[name] = Measured(command=command, machine=machine, rows=rows)
    text = msgspec.json.format(msgspec.json.encode(dict(sorted(results.items()))), indent=1)
    path.write_bytes(text + b"\n")
    return results


def page(results: Mapping[str, Measured] | None = None) -> str:
    """The whole page, by default of the figures in `results.json`."""
    results = read() if results is None else results
    named = {name for _, _, names in SECTIONS for name in names}
    others = tuple(name for name in results if name not in named)
    sections = (*SECTIONS, ("Further benchmarks", "", others))
    parts = (part for section in sections for part in _section(*section, results))
    return HEAD + "\n".join(parts)


def _section(
    title: str, text: str, names: tuple[str, ...], results: Mapping[str, Measured]
) -> Iterator[str]:
    present = [name for name in names if name in results]
    if not present:
        return
    yield f"\n## {title}\n"
    if text:
        yield f"{text}\n"
    for name in present:
        measured = results[name]
        yield f"### {name.replace('_', ' ')}\n"
        yield f"{as_markdown(measured.rows)}\n"
        yield f"`{measured.command}`, on {_described(measured.machine)}.\n"


def _described(machine: Mapping[str, str]) -> str:
    """What matters of the machine, in words: "AMD EPYC, 2 cores, load 2.3, 2026-11-22"."""
    words = {"processor": "{}", "cores": "{} cores", "load": "load {}", "date": "{}"}
    return ", ".join(text.format(machine[key]) for key, text in words.items() if key in machine)


def write(results: Mapping[str, Measured] | None = None) -> None:
    """Write the page."""
    PAGE.write_text(page(results), encoding="utf-8")
