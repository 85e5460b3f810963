"""Hidden effects, simulated: does the workbench name what is missing?

The plant is `sim_plant.oscillator`, which shares no equations with the engine. Each case hides one
effect, or two, or none, at a strength that changes the outputs by a given share of their rms; the
model is fitted to one recording of 20 s, judged on another, and a healthy recording with the same
excitation gives the noise floor.

    python -m benchmarks hidden_effects
"""

import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.table import Row
from rigwatch.physics.engine.effect import library
from rigwatch.physics.engine.fit import Recording
from rigwatch.physics.engine.model import shipped_models
from rigwatch.workbench.compare import Bench, noise_floor
from rigwatch.workbench.explain import ranking
from rigwatch.workbench.fitted import fit_base
from rigwatch.workbench.intervals import values
from rigwatch.workbench.rank import Ranked
from rigwatch.workbench.signals import Data
from rigwatch.workbench.study import Accepted, Span, Study, StudyFile
from rigwatch.workbench.verdict import Verdict, above_floor
from sim_plant.oscillator import (
    DAMPING,
    MASS,
    RATE,
    STIFFNESS,
    UNKNOWN,
    Hidden,
    oscillate,
    strength_for,
)

SAMPLES = 5120
HORIZON = 256
NOISE = 2e-3
"""Standard deviation of the sensors' noise over the rms of what they read."""
RIGHT: dict[str, tuple[str, ...]] = {
    "coulomb": ("coulomb@load",),
    "stribeck": ("stribeck@load",),
    "dahl": ("dahl@load", "bliman_sorine_1@load", "lugre@load"),
    "quadratic_drag": ("quadratic_drag@load",),
    "constant_force": ("constant_force@load", "offset@drive"),
    "cubic_stiffness": ("cubic_stiffness@load",),
    "quadratic_stiffness": ("quadratic_stiffness@load",),
    "hard_stop": ("hard_stop@load",),
    "backlash": ("backlash@load",),
    "bouc_wen": ("bouc_wen@load",),
    "end_binding": ("end_binding@load",),
    "viscous_by_direction": ("viscous_by_direction@load",),
    "dead_band": ("dead_band@drive",),
    "saturation": ("saturation@drive",),
    "valve_hysteresis": ("valve_hysteresis@drive",),
    "delay": ("delay@drive", "lag@drive"),
    "acceleration_lag": ("lag@acceleration_sensor", "delay@acceleration_sensor"),
    "position_lag": ("lag@position_sensor", "delay@position_sensor"),
    "acceleration_gain": ("gain@acceleration_sensor", "gain@position_sensor"),
    "position_offset": ("offset@position_sensor",),
    "position_drift": ("drift@position_sensor",),
}
"""What the library calls each hidden effect; several where they are one on any recording."""


@dataclass(frozen=True)
class Case:
    """One plant to be explained.

    Attributes:
        hidden: names; none for a healthy plant.
        share: of the outputs' rms that the effect changes.
        seed: of excitation and noise.
    """

    hidden: tuple[str, ...]
    share: float
    seed: int


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the workbench made of it."""

    case: Case
    verdict: Verdict
    rows: list[Ranked]
    base_ratio: float
    best_ratio: float
    seconds: float
    covered: tuple[int, int]

    @property
    def named(self) -> str:
        """Label of what is named, or the verdict."""
        return self.verdict.best.label if self.verdict.best else self.verdict.word

    @property
    def first(self) -> tuple[str, ...]:
        """The best with its class."""
        return self.verdict.members or (self.verdict.word,)

    @property
    def right(self) -> bool:
        """Whether what is hidden stands first, or in the class of the first."""
        return any(set(RIGHT[name]) & set(self.first) for name in self.case.hidden)

    @property
    def both(self) -> bool:
        """Whether each of two hidden effects is named, first or second."""
        named = set(self.first) | set(self.verdict.second)
        return all(set(RIGHT[name]) & named for name in self.case.hidden)


def excitation(seed: int) -> NDArray[np.float64]:
    """Force with lines from 0.25 to 8 Hz, rms 4 N."""
    time_, lines = np.arange(SAMPLES) / RATE, np.arange(0.25, 8, 0.25)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(time_, lines) + phases).sum(axis=1)
    return np.asarray(4 * waves / np.sqrt(len(lines) / 2))


def recorded(hidden: tuple[Hidden, ...], seed: int) -> Recording:
    """One recording of the plant, with sensor noise."""
    force = excitation(seed)
    size = oscillate(force, (), np.zeros(2), 0).std(axis=0)
    return Recording(1 / RATE, force[:, None], oscillate(force, hidden, NOISE * size, seed + 7))


def study(effects: tuple[Accepted, ...] = ()) -> Study:
    """A study of the mass-spring-damper in memory; its recordings are given to it."""
    span = (Span(session="simulated"),)
    start = {"m": 1.2 * MASS, "c": 0.8 * DAMPING, "k": 1.1 * STIFFNESS}
    file = StudyFile(
        model="mass-spring-damper", train=span, held_out=span, start=start, effects=effects
    )
    model = shipped_models()["mass-spring-damper"]
    return Study(Path(), file, model, library(), frozenset())


def solve(case: Case) -> Outcome:
    """Simulate a case and explain it."""
    share = case.share / max(np.sqrt(len(case.hidden)), 1.0)
    hidden = tuple(
        Hidden(name, strength_for(name, excitation(case.seed), share)) for name in case.hidden
    )
    healthy = recorded((), case.seed + 2000)
    data = Data(
        recorded(hidden, case.seed), recorded(hidden, case.seed + 1000), healthy, HORIZON, ()
    )
    begin = time.perf_counter()
    bench, rows, verdict = explained(study(), data)
    seconds = time.perf_counter() - begin
    best = verdict.best.fitted if verdict.best else None
    covered = _covered(bench) if not case.hidden else (0, 0)
    return Outcome(
        case, verdict, rows, above_floor(bench.base, bench.floor),
        above_floor(best, bench.floor) if best else np.nan, seconds, covered,
    )  # fmt: skip


def explained(of: Study, data: Data) -> tuple[Bench, list[Ranked], Verdict]:
    """The workbench's steps without its files."""
    scale = NOISE * np.nanstd(data.train.outputs, axis=0)
    base = fit_base(of, data, scale)
    bench = Bench(of, data, base, noise_floor(of, data, base))
    return bench, *ranking(bench)


def _covered(bench: Bench) -> tuple[int, int]:
    """Intervals that hold the true parameter, of how many."""
    true = {"m": MASS, "c": DAMPING, "k": STIFFNESS}
    found = values(bench.base.train)
    inside = [
        low <= true[name] <= high
        for name in true
        if (interval := found[name].interval) is not None
        for low, high in [interval]
    ]
    return sum(inside), len(inside)


def cases(quick: bool) -> Iterator[Case]:
    """What is tried."""
    seeds = range(1) if quick else range(20)
    for seed in seeds:
        for name in (
            ("coulomb", "cubic_stiffness", "acceleration_lag", "dead_band") if quick else RIGHT
        ):
            for share in (0.05,) if quick else (0.005, 0.01, 0.02, 0.05, 0.1):
                yield Case((name,), share, 10 + seed)
        for name in UNKNOWN[:1] if quick else UNKNOWN:
            yield Case((name,), 0.05, 10 + seed)
        for pair in (("coulomb", "cubic_stiffness"), ("quadratic_drag", "constant_force")):
            if not quick:
                yield Case(pair, 0.05, 10 + seed)
    for seed in range(2 if quick else 400):
        yield Case((), 0.0, 5000 + 3 * seed)


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    return rows_of([solve(case) for case in cases(quick)])


def rows_of(outcomes: list[Outcome]) -> list[Row]:
    """Rows from outcomes."""
    single = [o for o in outcomes if len(o.case.hidden) == 1 and o.case.hidden[0] in RIGHT]
    strong = [o for o in single if o.case.share >= 0.01]
    lagging = [o for o in strong if o.case.hidden[0].endswith("_lag")]
    healthy = [o for o in outcomes if not o.case.hidden]
    unknown = [o for o in outcomes if o.case.hidden and o.case.hidden[0] in UNKNOWN]
    pairs = [o for o in outcomes if len(o.case.hidden) == 2]
    sizes = sorted(len(o.first) for o in strong)
    noted = Counter(f"{o.case.hidden[0]} as {o.named}" for o in strong if not o.right)
    after = [o.best_ratio for o in strong if o.right]
    inside, of = (
        (sum(x) for x in zip(*(o.covered for o in healthy), strict=True)) if healthy else (0, 0)
    )
    return [
        _share("right effect or class first, from 1 %", [o.right for o in strong], 0.97,
               ", ".join(f"{k}: {n}" for k, n in noted.most_common(8))),
        _share("class of at most 3", [n <= 3 for n in sizes], 0.9, ""),
        _share("sensor lag named as such", [o.right for o in lagging], 0.95, ""),
        _share("healthy not called missing_effect",
               [o.verdict.word != "missing_effect" for o in healthy], 0.99, ""),
        _share("outside the library: unknown_effect",
               [o.verdict.word == "unknown_effect" for o in unknown], 0.95,
               ", ".join(f"{o.case.hidden[0]}: {o.verdict.word} {o.named}" for o in unknown[:8])),
        _share("two effects at once, both named", [o.both for o in pairs], 0.9,
               ", ".join(f"{'+'.join(o.case.hidden)}: {o.named}" for o in pairs[:6])),
        Row("held-out error over floor with the right effect, median",
            f"{np.median(after):.3f}" if after else "-", "≤ 1.10", "", "",
            bool(np.median(after) <= 1.1) if after else None),
        Row("95 % intervals that hold the truth (healthy)", f"{inside}/{of}", "93 to 97 %", "", "",
            None if of < 60 else 0.93 <= inside / of <= 0.97),
        Row("one explain with refits, median",
            f"{np.median([o.seconds for o in outcomes]):.1f} s", "10 s", "", "",
            bool(np.median([o.seconds for o in outcomes]) <= 10)),
    ]  # fmt: skip


def _share(what: str, hits: list[bool], bar: float, note: str) -> Row:
    count = f"{sum(hits)}/{len(hits)}"
    passed = None if not hits else sum(hits) >= bar * len(hits)
    return Row(what, count, f"≥ {bar:.0%}", "", note, passed)


def main() -> int:
    """Print one line a case: `python -m benchmarks.hidden_effects NAME SHARE SEED…`."""
    name, share, *seeds = sys.argv[1:]
    for seed in seeds:
        hidden = () if name == "healthy" else tuple(name.split("+"))
        found = solve(Case(hidden, float(share), int(seed)))
        print(
            name, share, seed, found.verdict.word, *found.first, found.verdict.rivals,
            found.verdict.second,
            f"{found.base_ratio:.3f} → {found.best_ratio:.3f}, {found.seconds:.1f} s", flush=True,
        )  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
