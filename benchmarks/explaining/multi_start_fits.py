"""Multi-start fits: does the fitting driver reach the noise floor from any initial values?

A mass on a spring in closed form (`sim_plant/specimens/exact_mass.py`), which shares nothing with
the engine, is drawn at random (mass over four decades, resonance 1 to 12 Hz, damping 2 to 50 %),
starts are drawn log-uniformly over six decades around the truth, horizons from 0.25 to 4 s. A fit
reaches the floor if its error is at most 1.1 times the noise; one that does not must be reported as
not converged, since a verdict would rely on it.

    python -m benchmarks multi_start_fits --quick
"""

import time

import numpy as np
from msgspec import structs

from benchmarks.explaining.hidden import share_row
from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import Hold, Model, shipped_models
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.search.multi_start_fit import multi_start_fit
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from sim_plant.specimens.exact_mass import RATE, Mass, excitation, moved
from tools.benchmark_table import Row

NOISE = 2e-3
"""Standard deviation of the noise, relative to the rms of a sensor's signal."""
HORIZONS = (64, 128, 256, 512, 1024)
REACHED = 1.1
DECADES = 3.0
SEED = 2000
"""First seed: none below was used while the driver was written."""


def drawn_plant(generator: np.random.Generator) -> Mass:
    """A plant with a resonance that the excitation reaches."""
    mass = 10 ** generator.uniform(-2, 2)
    omega = 2 * np.pi * 10 ** generator.uniform(0.0, np.log10(12.0))
    return Mass(mass, 2 * 10 ** generator.uniform(-1.7, -0.3) * mass * omega, mass * omega**2)


def position_alone(model: Model) -> Model:
    """The model without its accelerometer."""
    return structs.replace(
        model,
        outputs={"position": model.outputs["position"]},
        ports={name: p for name, p in model.ports.items() if p.signal != "acceleration"},
    )


def solved(seed: int, *, alone: bool) -> tuple[bool, bool, float]:
    """Whether a fit reaches the floor, whether it is reported as converged, and its time [s]."""
    generator = np.random.default_rng(seed)
    hold: Hold = "zero" if seed % 2 else "linear"
    plant, force = drawn_plant(generator), excitation(generator)
    read = moved(plant, force, held=hold == "zero")
    noise = NOISE * read.std(axis=0)
    read = read + noise * generator.normal(size=read.shape)
    model = structs.replace(shipped_models()["mass-spring-damper"], hold=hold)
    if alone:
        model, read, noise = position_alone(model), read[:, :1], noise[:1]
    start = plant.values * 10 ** generator.uniform(-DECADES, DECADES, 3)
    begin = time.perf_counter()
    found, ended = multi_start_fit(ShortHorizons(
        compile_system(compose(model)), Recording(1 / RATE, force[:, None], read),
        HORIZONS[seed // 2 % len(HORIZONS)], start=start, scale=noise, noise=noise, substeps=2,
    ))  # fmt: skip
    seconds = time.perf_counter() - begin
    reached = bool(np.sqrt(np.mean((found.rms / noise) ** 2)) <= REACHED)
    return reached, ended.converged, seconds


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    rows = []
    for alone, what in ((False, "position and acceleration"), (True, "position alone")):
        count = 20 if quick else 1000 if not alone else 200
        found = [solved(SEED + index, alone=alone) for index in range(count)]
        called = [not ended for reached, ended, _ in found if not reached]
        seconds = [each for *_, each in found]
        note = f"median {np.median(seconds):.2f} s, longest {max(seconds):.1f} s"
        if called:
            note += f"; {sum(called)} of {len(called)} that did not reach it said so"
        rows.append(
            share_row(
                f"fits from starts over six decades that reach the noise floor, {what}",
                [reached for reached, *_ in found], 0.995, note,
            )
        )  # fmt: skip
    return rows
