"""`python -m benchmarks [NAME...]`: runs the benchmarks and prints one table.

A benchmark is a module in a room of this folder with `def run(quick: bool) -> list[Row]`; no
registration is needed. `--page` stores the results and writes them to docs/benchmarks.md.
"""

import argparse
import importlib
import json
import os
import platform
import signal
import sys
import time
from dataclasses import asdict
from pathlib import Path

import benchmarks
from tools import benchmark_page
from tools.benchmark_table import Row, as_markdown, as_text, rows_of


def modules() -> dict[str, str]:
    """All benchmarks by name: the modules of the rooms with a function `run`."""
    sources = sorted(Path(benchmarks.__path__[0]).glob("*/*.py"), key=lambda path: path.stem)
    return {
        path.stem: f"benchmarks.{path.parent.name}.{path.stem}"
        for path in sources
        if "\ndef run(" in path.read_text(encoding="utf-8")
    }


def machine() -> dict[str, str]:
    """The machine of the measurement."""
    return {
        "processor": _processor(),
        "cores": str(len(os.sched_getaffinity(0))),
        "memory": f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "load": f"{os.getloadavg()[0]:.1f}",
        "date": time.strftime("%Y-%m-%d"),
    }


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def measure(name: str, quick: bool) -> list[Row]:
    """A benchmark's rows; prints its duration."""
    started = time.perf_counter()
    print(f"{name} ...", end=" ", file=sys.stderr, flush=True)
    rows = rows_of(name, lambda: importlib.import_module(modules()[name]).run(quick))
    print(f"{time.perf_counter() - started:.1f} s", file=sys.stderr)
    return rows


def main() -> int:
    """0 if every row with a bar reaches it, otherwise 1."""
    parser = _parser()
    arguments = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the commands do
    if unknown := set(arguments.names) - set(modules()):
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(modules())}")
    # A benchmark that is asked to end ends the processes that it has started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    results = {name: measure(name, arguments.quick) for name in arguments.names or modules()}
    rows = [row for found in results.values() for row in found]
    print("measured on " + ", ".join(f"{key} {value}" for key, value in machine().items()) + "\n")
    print(as_markdown(rows) if arguments.markdown else as_text(rows))
    if arguments.page and not arguments.quick:
        benchmark_page.write(benchmark_page.keep(results, machine()))
    if arguments.json:
        as_dicts = {name: [asdict(row) for row in found] for name, found in results.items()}
        text = {"machine": machine(), "results": as_dicts}
        arguments.json.write_text(json.dumps(text, indent=1), encoding="utf-8")
    return 1 if any(row.passed is False for row in rows) else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=__doc__,
        epilog=f"benchmarks: {', '.join(modules())}",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="which, default all")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, to try them")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the results there")
    parser.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    parser.add_argument(
        "--page",
        action="store_true",
        help="keep the results of a full run, and write docs/benchmarks.md",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
