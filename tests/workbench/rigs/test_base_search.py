"""Steps of the search for a base: a fit that ended in a wrong place is begun anew elsewhere."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.fit import Recording
from rigwatch.workbench.compare.bases.base_fit import Tried
from rigwatch.workbench.compare.bases.base_step import BaseSearch
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking import no_progress
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tests.workbench.fits.test_strength_intervals import RATE, STEPS, drive

COGS = """
name = "cogs"
summary = "A mass on a spring that a slow motor pushes over cogs."
[inputs.u]
unit = "N"
hold = "zero"
[quantities]
drag = { expression = "c*v", unit = "N" }
pull = { expression = "k*x", unit = "N" }
acceleration = { expression = "(q - drag - pull - h*sin(p*x) + load)/m", unit = "m/s^2" }
[states.x]
unit = "m"
derivative = "v"
measured = "position"
[states.v]
unit = "m/s"
derivative = "acceleration"
rate_of = "position"
[states.q]
unit = "N"
derivative = "w*(u - q)"
[parameters]
m = { value = 0.25, unit = "kg", fixed = true }
k = { value = 40.0, unit = "N/m", low = 0.0, fixed = true, kept = true }
c = { value = 0.5, unit = "N s/m", low = 0.0, fixed = true, kept = true }
w = { value = 60.0, unit = "1/s", low = 5.0, high = 500.0, fixed = true, kept = true }
h = { value = 0.2, unit = "N", low = 0.0, fixed = true, kept = true }
p = { value = 390.0, unit = "1/m", low = 10.0, high = 5000.0, fixed = true, kept = true }
[outputs.position]
unit = "m"
expression = "x"
[outputs.acceleration]
unit = "m/s^2"
expression = "acceleration"
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
[variants.turbulent]
physics = "The drag grows with the square of the speed."
parameters.d = { value = 0.1, unit = "N s^2/m^2", low = 0.0, fixed = true, kept = true }
quantities.drag = { expression = "c*v + d*v*abs(v)", unit = "N" }
[variants.stiffening]
physics = "The spring stiffens."
parameters.k3 = { value = 1e3, unit = "N/m^3", low = 0.0, fixed = true, kept = true }
quantities.pull = { expression = "k*x + k3*x**3", unit = "N" }
"""

NAME = "cogs.toml"
BOTH = {"turbulent", "stiffening"}


def cogs(seed: int) -> Recording:
    """A recording of a mass that has both variants, and 400 cogs for 2 pi metres."""
    force = drive(1, 4)
    x = v = q = 0.0
    h = 1 / (RATE * STEPS)
    read = np.empty((len(force), 2))
    for i, u in enumerate(force.tolist()):
        for j in range(STEPS):
            held = 0.4 * v + 3.0 * v * abs(v) + 50.0 * x + 4e4 * x**3 + 0.3 * np.sin(400.0 * x)
            a = (q - held) / 0.25
            if j == 0:
                read[i] = x, a
            q += h * 80.0 * (u - q)
            v += h * a
            x += h * v
    noise = np.random.default_rng(seed).normal(size=read.shape)
    return Recording(1 / RATE, force[:, None], read + noise * (2e-6, 0.02), parts=(len(force),))


def at_other_cogs(at: Tried, cogs_per_metre: float) -> Tried:
    """A base whose fit ended at another distance of the cogs."""
    train = at.fitted.train
    moved = train.compiled.vector(train.values() | {"p": cogs_per_metre})
    return replace(at, fitted=replace(at.fitted, train=replace(train, parameters=moved)))


def test_a_base_that_fits_worse_than_a_simpler_one_is_begun_anew_from_that() -> None:
    data = Data(cogs(0), cogs(1), None, 128, ())
    span = (Span(session="simulated"),)
    file = StudyFile(model=NAME, train=span, held_out=span, healthy=span)
    model = parse_model(COGS, NAME)
    study = Study(Path(), file, model, library(), frozenset(), own_files={NAME: COGS})
    search = BaseSearch(data, {}, 1.0, no_progress)
    first = search.first(study)
    alone = {one.study.file.variants: one for one in search.one_step(first)}
    wrong = at_other_cogs(alone["turbulent",], 1100.0)
    further = {frozenset(one.study.file.variants): one for one in search.one_step(wrong)}
    assert further[frozenset(BOTH)].base.held_out_error < 1.2
