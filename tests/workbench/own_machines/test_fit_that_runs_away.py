"""A spring that softens: begun too soft, the motion runs away within a window of the fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit import begun_from_given
from rigwatch.workbench.ranking import (
    Ranked,
    no_progress,
    rank_only,
    refit,
    refit_from_given,
    shapes_of,
)
from rigwatch.workbench.ranking.rank import _begin_from_best
from rigwatch.workbench.ranking.refitting import fit_started
from tests.workbench.machine import Table, studied
from tests.workbench.simulated import with_few_effects

SHIP = """
name = "ship"
summary = "A ship model, rolled by a moving weight."
inputs.moment = { unit = "N m" }
states.phi = { unit = "rad", derivative = "p", measured = "roll" }
states.p = { unit = "rad/s", derivative = "(moment - b*p - G*phi + hull)/I", measured = "rate" }
parameters.I = { value = 12.0, unit = "kg m^2", low = 0.05, high = 50.0 }
parameters.b = { value = 0.1, unit = "N m s/rad", low = 0.0 }
parameters.G = { value = 93.0, unit = "N m/rad", low = 0.1, high = 1000.0 }
outputs.roll = { unit = "rad", expression = "phi" }
outputs.rate = { unit = "rad/s", expression = "p" }
[ports.hull]
kind = "force"
unit = "N m"
variables.x = { expression = "phi", unit = "rad" }
variables.v = { expression = "p", unit = "rad/s" }
"""
RATE, SUBSTEPS = 20.0, 20
INERTIA, DAMPING, RIGHTING, SOFTER = 2.4, 0.5, 30.0, -11.0


def rolled(seed: int, softer: float = SOFTER, drag: float = 0.0, seconds: float = 120.0) -> Table:
    """Roll angle and rate under a slow random moment, read with noise."""
    draw = np.random.default_rng(seed)
    tones = draw.uniform(0.2, 0.8, 6)
    moment = np.sin(2 * np.pi * np.outer(_fine(seconds), tones) + 40 * tones).sum(axis=1) * 1.2
    return _read(moment, softer, drag, draw)


def swept(seed: int, begin: float) -> Table:
    """The same under a moment that sweeps down through the resonance."""
    fine = _fine(80.0)
    moment = 1.4 * np.sin(2 * np.pi * (0.65 * fine - 0.1 * fine**2 / fine[-1]))
    return _read(moment, -14.0, 0.0, np.random.default_rng(seed), begin)


def _fine(seconds: float) -> FloatArray:
    return np.arange(round(seconds * RATE) * SUBSTEPS) / (RATE * SUBSTEPS)


def _read(
    moment: FloatArray, softer: float, drag: float, draw: np.random.Generator, begin: float = 0.0
) -> Table:
    count = len(moment) // SUBSTEPS
    angle, rate = begin, 0.0
    angles, rates = np.empty(count), np.empty(count)
    for n, push in enumerate(moment):
        if n % SUBSTEPS == 0:
            angles[n // SUBSTEPS], rates[n // SUBSTEPS] = angle, rate
        force = (
            push - DAMPING * rate - RIGHTING * angle - softer * angle**3 - drag * rate * abs(rate)
        )
        rate += force / INERTIA / (RATE * SUBSTEPS)
        angle += rate / (RATE * SUBSTEPS)
    noise = draw.normal(size=(2, count))
    return {
        "moment": moment[::SUBSTEPS],
        "roll": angles + 0.003 * np.std(angles) * noise[0],
        "rate": rates + 0.003 * np.std(rates) * noise[1],
    }


def _bench(folder: Path, model: str, train: Table, held_out: Table, *more: str) -> Bench:
    units = {"moment": "N m", "roll": "rad", "rate": "rad/s"}
    made = studied(folder, model, [train], [held_out], units, "horizon = 8.0", [RATE, RATE])
    return with_few_effects(open_bench(made), *more)


def _begun_at(inertia: float, damping: float, righting: float) -> str:
    """The model's file with other starting values."""
    model = SHIP.replace("I = { value = 12.0", f"I = {{ value = {inertia}")
    model = model.replace("b = { value = 0.1", f"b = {{ value = {damping}")
    return model.replace("G = { value = 93.0", f"G = {{ value = {righting}")


def test_an_effect_whose_fit_runs_away_is_begun_over_short_horizons(tmp_path: Path) -> None:
    verdict = ranking(_bench(tmp_path, SHIP, rolled(4), rolled(6)))[1]
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "cubic_stiffness@hull")


def test_where_the_base_ends_far_off_the_given_values_begin_the_fit(tmp_path: Path) -> None:
    bench = _bench(tmp_path, _begun_at(0.8, 1.5, 19.0), swept(1, 0.3), swept(2, 0.2))
    verdict = ranking(bench)[1]
    assert bench.base.train.values()["I"] < 0.5 * INERTIA
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "cubic_stiffness@hull")


def test_what_ends_in_a_local_minimum_begins_over_short_horizons(tmp_path: Path) -> None:
    far = {"I": 10.0, "b": 1.0, "G": 223.0}
    bench = _bench(tmp_path, _begun_at(*far.values()), swept(1, 0.3), swept(2, 0.2))
    study, data, base = bench.study, bench.data, bench.base
    row = rank_only(study, data, base, shapes_of(study, data.train, "cubic_stiffness", "hull"))
    refit(study, data, base, row, fit_started(lambda *_: far | {"hull_cubic_stiffness_k3": -200.0}))
    stuck = row.fitted
    assert stuck is not None
    assert begun_from_given(study, data, stuck) is stuck
    refit_from_given(study, data, base, row)
    assert row.fitted is not None
    assert row.fitted.train_error < 0.1 * stuck.train_error
    assert row.fitted.train.values()["I"] == pytest.approx(INERTIA, rel=0.05)


def test_what_ended_above_the_base_begins_from_the_best_ones_parameters(tmp_path: Path) -> None:
    far = {"I": 10.0, "b": 1.0, "G": 223.0}
    bench = _bench(tmp_path, _begun_at(*far.values()), swept(1, 0.3), swept(2, 0.2), "hard_stop")
    study, data, base = bench.study, bench.data, bench.base

    def row(effect: str, **strength: float) -> Ranked:
        made = rank_only(study, data, base, shapes_of(study, data.train, effect, "hull"))
        refit(study, data, base, made, fit_started(lambda *_: far | strength))
        return made

    best, stuck = row("hard_stop"), row("cubic_stiffness", hull_cubic_stiffness_k3=-200.0)
    stuck.likely = True
    refit_from_given(study, data, base, best)
    assert stuck.fitted is not None
    assert stuck.fitted.train_error > base.train_error > (best.fitted or base).train_error
    _begin_from_best(study, data, base, [best, stuck], bench.floor, no_progress)
    assert stuck.fitted.train_error < 0.1 * base.train_error


def _of_starts_that_do_not_agree(bench: Bench) -> Bench:
    ended = bench.base.convergence
    assert ended is not None
    apart = replace(ended, converged=False, reason="none of 7 starts leads where another does")
    return replace(bench, base=replace(bench.base, convergence=apart))


def test_an_effect_that_leaves_only_noise_is_named_where_fits_without_it_do_not_agree(
    tmp_path: Path,
) -> None:
    bench = _bench(tmp_path, _begun_at(2.0, 0.3, 25.0), swept(1, 0.3), swept(2, 0.2))
    _, verdict = ranking(_of_starts_that_do_not_agree(bench))
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "cubic_stiffness@hull")
    assert verdict.text.endswith(
        "the fit of the model did not converge: none of 7 starts leads where another does, but"
        " with the effect only noise is left"
    )


def test_where_no_effect_leaves_only_noise_fits_that_do_not_agree_are_no_basis(
    tmp_path: Path,
) -> None:
    bench = _bench(tmp_path, _begun_at(2.0, 0.3, 25.0), swept(1, 0.3), swept(2, 0.2))
    known = {name: e for name, e in bench.study.effects.items() if name != "cubic_stiffness"}
    poorer = replace(bench, study=replace(bench.study, effects=known))
    _, verdict = ranking(_of_starts_that_do_not_agree(poorer))
    assert verdict.word == "model_inadequate"
