"""Strengths along the measured motion: their intervals hold the truth, counted over many plants.

The plants are slides on a spring, driven through a motor. Their dry friction falls with speed and
is smooth near standstill; the effect fitted to it is constant and steep.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.fit import Fit, Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import bench_of, determined_by_healthy
from rigwatch.workbench.compare.regimes import between
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data.repeats import repeat_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.fit.intervals import Value, covariance, values
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile

MODEL = """
name = "slide"
summary = "A mass on a spring that a slow motor pushes; position and acceleration are measured."
[inputs.u]
unit = "N"
hold = "zero"
[quantities]
acceleration = { expression = "(q - c*v - k*x + load)/m", unit = "m/s^2" }
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
derivative = "w*(g*u - q)"
[parameters]
m = { value = 0.25, unit = "kg", fixed = true }
k = { value = 50.0, unit = "N/m", low = 0.0, fixed = true, kept = true }
c = { value = 0.5, unit = "N s/m", low = 0.0, fixed = true, kept = true }
g = { value = 1.2, unit = "1", kept = true, fixed = true }
w = { value = 80.0, unit = "1/s", low = 5.0, high = 500.0, fixed = true, kept = true }
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
"""
STRENGTH = "load_coulomb_Fc"
RATE, STEPS, PERIOD = 256, 8, 1024
PLANTS = 12
RISE, SPEED = 0.4, 0.03
"""Dry friction rises by some 40 % below 0.03 m/s."""


def drive(seed: int, periods: int, step: int = 2) -> FloatArray:
    """A multisine [N] of every `step`-th line; with odd lines it inverts after half a period."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 40)
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    lines = 3 + step * np.arange(40)
    spectrum[lines] = np.exp(1j * phases)
    wave = np.fft.irfft(spectrum, PERIOD)
    return np.tile(1.5 * wave / wave.std(), periods)


def slide(seed: int, friction: float, rise: float, speed: float) -> Recording:
    """A recording of a slide whose friction rises by `rise` below `speed` [m/s]."""
    force = drive(1, 4)
    x = v = q = 0.0
    h = 1 / (RATE * STEPS)
    read = np.empty((len(force), 2))
    smooth = 0.1 * speed
    for i, u in enumerate(force.tolist()):
        for j in range(STEPS):
            level = friction * (1 + rise * np.exp(-((v / speed) ** 2))) * np.tanh(v / smooth)
            a = (q - 0.4 * v - 60.0 * x - 500.0 * x**3 - level) / 0.25
            if j == 0:
                read[i] = x, a
            q += h * 90.0 * (u - 0.002 * u**3 - q)
            v += h * a
            x += h * v
    noise = np.random.default_rng(seed).normal(size=read.shape)
    return Recording(1 / RATE, force[:, None], read + noise * (2e-6, 0.02), parts=(len(force),))


def found_in(seed: int) -> tuple[Fit, float, Value, Value]:
    """A fit, the true strength, and that found: with its whole interval, and that of its scatter.

    The law of the friction and its strength are drawn from the seed.
    """
    draw = np.random.default_rng([7, seed])
    friction, rise, speed = draw.uniform(0.1, 0.3), RISE * draw.uniform(0.5, 1.5), SPEED
    made = [slide(3 * seed + k, friction, rise, speed) for k in range(2)]
    data = Data(*made, slide(3 * seed + 2, 0.0, 0.0, speed), 128, ())
    span = (Span(session="simulated"),)
    file = StudyFile(model="slide", train=span, held_out=span, healthy=span)
    study = Study(Path(), file, parse_model(MODEL, "slide.toml"), library(), frozenset())
    bench = bench_of(*determined_by_healthy(study, data))
    effect = bench.study.effect_at("coulomb", "load").scaled({"x": 0.01, "v": 0.1, "F": 1.0})
    start = bench.base.train.values() | {STRENGTH: friction}
    placement = Placement("coulomb", effect, "load")
    found = fit_model(bench.study, bench.data, (placement,), start, bench.base.train.scale)
    more = added_variances(bench.study, bench.data, bench.bare, found)
    whole, scatter = (values(found.train, each)[STRENGTH] for each in (more, None))
    return found.train, friction, whole, scatter


@pytest.mark.nightly
def test_intervals_hold_strengths_of_plants_with_other_laws() -> None:
    every = [found_in(seed)[1:] for seed in range(PLANTS)]
    held = [holds(whole, truth) for truth, whole, _ in every]
    assert np.mean(held) >= 0.9
    # The scatter of the recording alone does not show that the law is another.
    assert np.mean([holds(scatter, truth) for truth, _, scatter in every]) < 0.5
    assert np.median([half_width(whole) for _, whole, _ in every]) < 0.08


def test_repeating_a_recording_does_not_narrow_the_interval_of_model_error() -> None:
    fitted = found_in(0)[0]
    once = slice(0, PERIOD // 2)
    error, slopes = (np.tile(a[:, once], (1, 6) + (1,) * (a.ndim - 2)) for a in
                     (fitted.error, fitted.jacobian))  # fmt: skip
    repeated = replace(fitted, error=error, jacobian=slopes)
    single = replace(fitted, error=error[:, once], jacobian=slopes[:, once])
    counted_once, by_time, alone = (
        float(covariance(fit, repeat)[0][0, 0])
        for fit, repeat in ((repeated, PERIOD // 2), (repeated, 0), (single, 0))
    )
    assert counted_once == pytest.approx(alone, rel=0.6)
    assert by_time < 0.4 * counted_once


def test_a_parameter_that_shows_in_few_windows_has_the_interval_of_few_degrees_of_freedom() -> None:
    fitted = found_in(0)[0]
    random = np.random.default_rng(3)
    seldom = np.where(np.arange(20) % 7 == 0, 1.0, 0.02)[:, None, None] * np.ones((20, 16, 1))
    hits = []
    for _ in range(400):
        noise = random.normal(size=(20, 16))
        moved = float(np.sum(seldom[..., 0] * noise) / np.sum(seldom**2))
        left = replace(fitted, error=noise - moved * seldom[..., 0], jacobian=seldom)
        value = values(left)[STRENGTH]
        hits.append(abs(moved) <= half_width(value) * value.value)
    # With the 19 degrees of freedom of 20 blocks it would be nine tenths or less.
    assert 0.93 <= np.mean(hits) <= 0.99
    assert covariance(left)[1][0] < 4


def lone(fitted: Fit, shown: FloatArray, memory: float, noise: FloatArray) -> tuple[float, Value]:
    """What a parameter seems to be that only the eighth window shows, and its interval.

    Args:
        fitted: any fit with one free parameter.
        shown: how it moves each sample of that window, shape (samples,).
        memory: share of the error that the next sample keeps.
        noise: of all windows, shape (20, samples).
    """
    slopes = np.zeros((20, len(shown), 1))
    slopes[7, :, 0] = shown
    error = lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], noise, axis=1)
    moved = float(np.sum(slopes[..., 0] * error) / np.sum(slopes**2))
    left = replace(fitted, error=error - moved * slopes[..., 0], jacobian=slopes)
    return moved, values(left)[STRENGTH]


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_a_parameter_that_one_window_alone_shows_has_the_interval_of_its_parts(
    memory: float,
) -> None:
    fitted, random, hits, widths = found_in(0)[0], np.random.default_rng(4), [], []
    for _ in range(300):
        moved, value = lone(fitted, np.ones(256), memory, random.normal(size=(20, 256)))
        hits.append(abs(moved) <= half_width(value) * value.value)
        widths.append(half_width(value) * value.value)
    assert 0.9 <= np.mean(hits) <= 0.995
    # With the noise known, 1.96 standard deviations.
    known = 1.96 * np.sqrt((1 + memory) / (1 - memory) / 256)
    assert known < np.median(widths) < 2.5 * known


def test_a_parameter_that_a_single_sample_shows_has_none() -> None:
    noise = np.random.default_rng(5).normal(size=(20, 16))
    _, value = lone(found_in(0)[0], np.eye(16)[3], 0.0, noise)
    assert half_width(value) > 1e9


def test_errors_that_last_longer_than_a_block_do_not_narrow_an_interval() -> None:
    fitted = found_in(0)[0]
    random = np.random.default_rng(5)
    slow = np.sin(np.arange(1000) / 60).reshape(4, 250, 1)
    hits = []
    for _ in range(200):
        noise = lfilter([1.0], [1.0, -0.98], random.normal(size=1500))[500:].reshape(4, 250)
        moved = float(np.sum(slow[..., 0] * noise) / np.sum(slow**2))
        left = replace(fitted, error=noise - moved * slow[..., 0], jacobian=slow)
        hits.append(abs(moved) <= half_width(values(left)[STRENGTH]) * left.values()[STRENGTH])
    assert np.mean(hits) >= 0.9


def test_chance_is_no_difference_between_regimes() -> None:
    found = []
    for seed in range(200):
        random = np.random.default_rng(seed)
        direction = random.choice([-1.0, 1.0], 2000)
        error = 0.1 * random.normal(size=2000)
        error -= direction * float(direction @ error) / 2000
        size, block = random.uniform(0, 1, 2000), np.arange(2000) // 100
        found.append(between(direction, error, size, block))
    # Its own variance is 0.1²/2000; that of a fifth is five times this.
    assert np.mean(found) < 0.1**2 / 2000 * 5 / 2


def test_a_strength_that_changes_evenly_has_the_variance_of_a_line() -> None:
    size = np.linspace(0, 1, 5000)
    regime = np.floor(5 * size).clip(0, 4)
    error = -(regime - 2) / 2 * 0.3
    found = between(np.ones(5000), error, size, np.arange(5000) % 20)
    assert found == pytest.approx(5 / 8 * 0.3**2, rel=0.01)


@pytest.mark.parametrize(("lines", "repeat"), [(2, PERIOD // 2), (1, PERIOD)])
def test_an_excitation_of_odd_lines_repeats_inverted_after_half_a_period(lines, repeat) -> None:
    recording = Recording(1 / RATE, drive(5, 3, lines)[:, None], np.zeros((3 * PERIOD, 1)))
    assert repeat_of(recording) == repeat


def test_noise_never_repeats() -> None:
    noise = np.random.default_rng(1).normal(size=(3000, 1))
    assert repeat_of(Recording(1 / RATE, noise, np.zeros((3000, 1)))) == 0


def holds(value: Value, truth: float) -> bool:
    assert value.interval is not None
    return value.interval[0] <= truth <= value.interval[1]


def half_width(value: Value) -> float:
    assert value.interval is not None
    return (value.interval[1] - value.interval[0]) / 2 / value.value


def test_a_parameter_that_hardly_moves_the_model_has_a_wide_interval() -> None:
    faint = np.full((20, 16, 1), 1e-180)
    noise = np.random.default_rng(4).normal(size=(20, 16))
    value = values(replace(found_in(0)[0], error=noise, jacobian=faint))[STRENGTH]
    assert value.interval is not None
    assert value.interval[0] < -1e60
    assert value.interval[1] > 1e60
