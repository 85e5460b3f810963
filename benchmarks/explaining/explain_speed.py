"""Time of an explanation: scoring, a whole explanation, and a new expression.

The recording is 20 s at 256 Hz of three channels (force, position, acceleration) from the
oscillator of `hidden_effects`, with Coulomb friction hidden at 5 % of the outputs' rms. A whole
explanation and a new expression run in separate processes, with empty caches and with those that
an explanation leaves. The caches contain the loops around the equations but not the equations, so
an expression is new to every process.

    python -m benchmarks explain_speed
"""

import json
import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.explaining.hidden_effects import NOISE, excitation, explained, noisy
from rigwatch.physics.engine.equations.effect_files import load_effects
from rigwatch.physics.engine.score.significance import corrected_p_values
from rigwatch.workbench.compare.compare import comparison
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking.candidates import candidates
from rigwatch.workbench.ranking.refitting import refit
from rigwatch.workbench.ranking.scoring import rank_only, score_all
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import HORIZON, study
from tools.benchmark_table import Row

CANDIDATES = 30
SEED = 11
BARS = {"score": 0.2, "explain": 10.0, "expression": 5.0}
"""[s]"""
EXPRESSION = """
[effects.sliding_seal]
port = "force"
expression = "-Fs*tanh(v/vs)*(1 + a*abs(x)/(xe + abs(x)))*exp(-(v/ve)**2/(1 + (x/xe)**2))"
physics = "A seal that grips more the further it is from the middle, and less the faster it slides."
source = "made up for this benchmark"
parameters.Fs = { unit = "{F}", role = "strength" }
parameters.a = { unit = "1", value = 0.5, low = 0.0, high = 5.0 }
parameters.ve = { unit = "{v}", value = 2.0, low = 0.2, high = 20.0, scale = "v" }
parameters.xe = { unit = "{x}", role = "constant", value = 1.0, scale = "x" }
parameters.vs = { unit = "{v}", role = "constant", value = 1e-3, scale = "v" }
"""


def recordings() -> Data:
    """The study to be explained."""
    hidden = (Hidden("coulomb", strength_for("coulomb", excitation(SEED), 0.05)),)
    held_out, healthy = noisy(hidden, SEED + 1000), noisy((), SEED + 2000)
    return Data(noisy(hidden, SEED), held_out, healthy, HORIZON, ())


def opened(data: Data) -> Bench:
    """The base model fitted, and the noise floor."""
    return bench_of(study(), data, NOISE * np.nanstd(data.train.outputs, axis=0))


def scoring(data: Data, repeats: int) -> Row:
    """Directions, projection and p-values of 30 candidates, all of them known to the process."""
    bench = opened(data)
    base, found = bench.base, candidates(bench.study, data.train)[:CANDIDATES]
    taken: dict[str, list[float]] = {"scores": [], "p-values": []}
    residual = base.train.residuals / base.train.scale
    for _ in range(repeats + 1):
        begin = time.perf_counter()
        scores = score_all(data, base, found)
        middle = time.perf_counter()
        corrected_p_values(scores, residual)
        taken["scores"].append(middle - begin)
        taken["p-values"].append(time.perf_counter() - middle)
    phases = {name: statistics.median(seconds[1:]) for name, seconds in taken.items()}
    whole = sum(phases.values())
    told = ", ".join(f"{name} {seconds * 1e3:.0f} ms" for name, seconds in phases.items())
    first = f"the first time {taken['scores'][0] + taken['p-values'][0]:.2f} s"
    return _row(f"scoring {len(found)} candidates", whole, "score", f"{told}; {first}")


def explaining(data: Data) -> str:
    """A whole explanation, with refits."""
    _, rows, verdict = explained(study(), data)
    fits = sum(row.fitted is not None for row in rows)
    return f"{len(rows)} effects at ports ranked, {fits} fitted: {verdict.text}"


def comparing(data: Data) -> str:
    """A new expression read, compiled, scored, fitted with the base model and judged."""
    bench = opened(data)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "own.toml"
        path.write_text(EXPRESSION, encoding="utf-8")
        own = load_effects(path)
    of = replace(bench.study, effects={**bench.study.effects, **own})
    found = [c for c in candidates(of, data.train) if c.name in own]
    row = rank_only(of, data, bench.base, found)
    refit(of, data, bench.base, row)
    if row.fitted is None:
        raise RuntimeError(row.failure)
    before = comparison(bench).held_out_error
    after = comparison(replace(bench, study=of, base=row.fitted)).held_out_error
    return f"held-out error from {before:.2f} to {after:.2f} noise floors: {row.reason}"


STEPS = {"explain": explaining, "expression": comparing}


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    data = recordings()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "recordings"
        file.write_bytes(pickle.dumps(data))
        return [scoring(data, 3 if quick else 15), *_in_processes(file, 1 if quick else 3)]


def _in_processes(file: Path, repeats: int) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as caches:
        yield _step("explain", "explain with refits, empty caches", file, caches, 1)
        yield _step("explain", "explain with refits, caches kept", file, caches, repeats)
        what = "new expression compiled, fitted, compared"
        yield _step("expression", what, file, caches, repeats)
    with tempfile.TemporaryDirectory() as caches:
        row = _step("expression", f"{what}, empty caches", file, caches, 1)
        yield replace(row, bar="", passed=None)


def _step(step: str, what: str, file: Path, caches: str, repeats: int) -> Row:
    """Median of a step's time, each in a separate process."""
    folders = {"NUMBA_CACHE_DIR": f"{caches}/numba"}
    found = []
    for _ in range(repeats):
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks.explaining.explain_speed", step, str(file)],
            env={**os.environ, **folders}, stdout=subprocess.PIPE, check=True,
        )  # fmt: skip
        found.append(json.loads(done.stdout))
    seconds = statistics.median(each["seconds"] for each in found)
    used, before = found[0]["processor"], found[0]["before"]
    note = f"{used:.1f} s of processor time, {before:.1f} s of imports not counted"
    return _row(what, seconds, step, f"{note}; {found[0]['told']}")


def _row(what: str, seconds: float, bar: str, note: str) -> Row:
    limit = BARS[bar]
    return Row(what, f"{seconds:.2f} s", f"< {limit:g} s", "", note, seconds < limit)


def main() -> int:
    """One step in this process, timed after the imports."""
    step, file = sys.argv[1:]
    data = pickle.loads(Path(file).read_bytes())
    before, begin = time.process_time(), time.perf_counter()
    told = STEPS[step](data)
    seconds, used = time.perf_counter() - begin, time.process_time() - before
    print(json.dumps({"seconds": seconds, "processor": used, "before": before, "told": told}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
