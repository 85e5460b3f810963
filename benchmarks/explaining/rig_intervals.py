"""Stated 95 % intervals on the simulated rig: how often do they contain the effect's strength?

Effects whose strength plant and library define alike, at four strengths, each fitted with the
analytic model to 20 s, with parameters from a healthy recording.

    python -m benchmarks rig_intervals
"""

from collections import Counter
from collections.abc import Iterator

from benchmarks.explaining.hidden import counted, share_row
from benchmarks.explaining.hidden_effects_rig import Case, simulated, study_of
from benchmarks.explaining.rig_hidden import settings
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data.noise.noise_floor import quiet_scale
from rigwatch.workbench.fit.intervals import values
from rigwatch.workbench.ranking.candidates import shapes_of
from rigwatch.workbench.ranking.refitting import refit
from rigwatch.workbench.ranking.scoring import rank_only
from tools.benchmark_table import Row

STRENGTHS = {
    "viscous": ("viscous", "load", "d"),
    "coulomb": ("coulomb", "load", "Fc"),
    "quadratic_drag": ("quadratic_drag", "load", "b"),
    "spring": ("linear_stiffness", "load", "k"),
    "cubic_spring": ("cubic_stiffness", "load", "k3"),
    "actuator_gain": ("gain", "drive", "g"),
    "position_gain": ("gain", "position_sensor", "g"),
    "acceleration_gain": ("gain", "acceleration_sensor", "g"),
    "acceleration_bias": ("offset", "acceleration_sensor", "u0"),
}
"""Effect, port and parameter of the library that a hidden effect of the plant sets."""
SHARES = (0.01, 0.02, 0.05, 0.1)
SEEDS = 5


def cases(quick: bool) -> Iterator[Case]:
    """The case that is fitted."""
    for seed in range(1, 2 if quick else SEEDS + 1):
        for share in (0.05,) if quick else SHARES:
            for name in STRENGTHS:
                yield Case("analytic", (name,), share, seed)


def covers(case: Case) -> bool:
    """Whether the interval of the hidden effect's strength contains its true value."""
    name = case.hidden[0]
    study, healthy = study_of(case.model, case.seed)
    true = settings(name, case.share, case.seed)
    data = simulated(case, {name: true}, healthy)
    bench = bench_of(study, data, quiet_scale(data.train))
    effect, port, parameter = STRENGTHS[name]
    found = shapes_of(study, data.train, effect, port)
    row = rank_only(study, data, bench.base, found)
    refit(study, data, bench.base, row)
    assert row.fitted is not None
    more = added_variances(study, data, bench.bare, row.fitted)
    interval = values(row.fitted.train, more)[row.placement.prefix + parameter].interval
    assert interval is not None
    return interval[0] <= true <= interval[1]


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    every = list(cases(quick))
    held = [covers(case) for case in every]
    missed = Counter(f"{c.hidden[0]} {c.share:g}" for c, inside in zip(every, held, strict=True)
                     if not inside)  # fmt: skip
    return [
        share_row("rig: 95 % intervals hold the strength", held, None, counted(missed.elements()))
    ]
