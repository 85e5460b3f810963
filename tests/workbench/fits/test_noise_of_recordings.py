"""The noise of a channel over several recordings, which step where they join, and short ones."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.signal import welch

from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.fit.decimation import Thinning
from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.columns import Columns
from rigwatch.workbench.data.noise.noise_floor import (
    NoiseFloor,
    find_period,
    from_residual,
    quiet_scale,
    repeats_at_once,
)
from rigwatch.workbench.data.noise.quietest_band import quietest_band
from rigwatch.workbench.data.noise.rounding import rounding
from rigwatch.workbench.data.recorded_columns import with_derived
from rigwatch.workbench.data.repeats import repeat_of
from rigwatch.workbench.study import Study
from rigwatch.workbench.study.study_file import Derive, Derived

NOISE, RATE = 1e-3, 200.0


def run_at(level: float, samples: int, seed: int) -> Recording:
    time = np.arange(samples) / RATE
    noise = NOISE * np.random.default_rng(seed).normal(size=samples)
    position = level + 0.2 * np.sin(2 * np.pi * 1.5 * time) + noise
    return Recording(1 / RATE, np.zeros((samples, 1)), position[:, None])


def test_it_is_that_of_each_recording() -> None:
    levels = np.linspace(-1.0, 1.0, 12)
    runs = [run_at(level, 1200, seed) for seed, level in enumerate(levels)]
    assert quiet_scale(joined(runs)) == pytest.approx([NOISE], rel=0.15)


def test_a_short_recording_does_not_hide_the_others() -> None:
    runs = [run_at(0.0, 4000, 1), run_at(1.0, 20, 2)]
    assert quiet_scale(joined(runs)) == pytest.approx([NOISE], rel=0.15)


@pytest.mark.parametrize(("samples", "within"), [(1200, 0.3), (12000, 0.15)])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("low_pass", [10.0, 60.0])
def test_a_derived_output_has_the_noise_that_its_low_pass_leaves(
    low_pass: float, order: int, samples: int, within: float
) -> None:
    """In the filter's stop band there is none, and a derivative has little at low frequencies."""
    known = {name: Derived(channel="x", order=order) for name in ("moved", "noise")}
    derive = Derive(low_pass=low_pass, signals=known)
    run = run_at(0.3, samples, 3)
    motion, position = 0.2 * np.sin(2 * np.pi * 1.5 / RATE * np.arange(samples)), run.outputs[:, 0]
    made = with_derived(Columns(1 / RATE, {"x": position}), derive)
    noise = with_derived(Columns(1 / RATE, {"x": position - motion}), derive).values["noise"]
    derived = (made.derived["moved"],)
    found = quiet_scale(replace(run, outputs=made.values["moved"][:, None], derived=derived))
    assert found == pytest.approx([noise[100:-100].std()], rel=within)
    left = cast("Fit", SimpleNamespace(residuals=noise[None, :, None]))
    floor = from_residual(left, replace(run, derived=derived), 0.0, samples)
    assert floor.rms == pytest.approx(found, rel=within)


def test_joined_recordings_keep_what_is_passed_in_each() -> None:
    runs = [run_at(0.0, 1200, 1), replace(run_at(0.0, 1200, 2), passed=0.2)]
    assert joined(runs).passed == 0.2


@pytest.mark.parametrize("samples", [120, 240, 600, 5120])
def test_noise_alone_is_within_the_limit_however_short_the_recording(samples: int) -> None:
    draws = np.random.default_rng(samples).normal(0.0, NOISE, (100, samples))
    assert sum(not reached(noise) for noise in draws) <= 3


@pytest.mark.parametrize("samples", [240, 600])
def test_a_motion_of_the_size_of_the_noise_is_above_it(samples: int) -> None:
    motion = 1.5 * NOISE * np.sin(2 * np.pi * 3 * np.arange(samples) / RATE)
    draws = np.random.default_rng(samples).normal(0.0, NOISE, (100, samples))
    assert sum(reached(motion + noise) for noise in draws) <= 20


def test_a_long_recording_has_the_level_of_its_quietest_band() -> None:
    noise = np.random.default_rng(3).normal(0.0, NOISE, 6000)
    frequencies, density = welch(noise, RATE, nperseg=256)
    lowest = min(band.mean() for band in np.array_split(density[frequencies > 0], 8))
    assert quietest_band([noise], RATE) == (pytest.approx(np.sqrt(lowest * RATE / 2)), 1.0)


@pytest.mark.parametrize("swapped", [False, True])
def test_a_period_is_that_of_all_inputs_in_any_order(*, swapped: bool) -> None:
    sample = np.arange(3000)
    fast, slow = (np.sin(2 * np.pi * sample / period) for period in (250, 375))
    free = np.random.default_rng(1).normal(size=len(sample))
    constant, motion = np.full(len(sample), 2.0), free

    def driven_by(*inputs: FloatArray, driving: int | None = None) -> Recording:
        columns = np.stack(inputs[::-1] if swapped and driving is None else inputs, axis=1)
        return Recording(1 / RATE, columns, np.zeros((len(sample), 1)), driving=driving)

    assert find_period(driven_by(fast, constant)) == 250
    assert find_period(driven_by(fast, slow)) == 750
    assert find_period(driven_by(fast, free)) == 0
    assert find_period(driven_by(fast, motion, driving=1)) == 250
    assert repeat_of(driven_by(fast, slow)) == 750
    assert repeat_of(driven_by(fast, free)) == 0


def reached(residual: FloatArray) -> bool:
    """Whether an error of this residual is at the noise floor that follows from it."""
    rms, chance = quietest_band([residual], RATE)
    floor = NoiseFloor(np.array([rms]), "quiet band", chance)
    return floor.reached(cast("Fit", SimpleNamespace(rms=np.array([residual.std()]))))


def cycled(period: float, sensor: float = 1e-3) -> tuple[Fit, Recording]:
    """A triangle, and a residual with a spike after each reversal that is thinned to one in nine.

    Args:
        period: of the triangle [samples].
        sensor: noise of the measured triangle.
    """
    n = np.arange(4000)
    draws = np.random.default_rng(5).normal(size=(2, len(n)))
    phase = n / period % 0.5 * period
    spikes = np.where(n / period % 1 < 0.5, 1.0, -1.0) * np.exp(-phase / 8) * (phase / 8)
    drive = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * n / period)) + sensor * draws[0]
    thinning = Thinning(9, 2, (len(n),))
    left = thinning.apply((spikes + 0.1 * draws[1])[None, :, None])
    fitted = SimpleNamespace(residuals=left, rms=np.sqrt(np.mean(left**2, axis=(0, 1))))
    return cast("Fit", fitted), Recording(1 / RATE, drive[:, None], drive[:, None], thinning)


@pytest.mark.parametrize("period", [464.76, 187.31, 618.4])
def test_what_a_wrong_model_leaves_at_each_reversal_is_not_noise(period: float) -> None:
    fitted, recording = cycled(period)
    noise, quiet = (
        cycled(1e9)[0].residuals.std(),
        quietest_band([fitted.residuals[0, :, 0]], RATE / 9, 0.38),
    )
    floor = from_residual(fitted, recording, 0.0, len(recording), at_once=True)
    assert floor.rms == pytest.approx([noise], rel=0.2)
    assert floor.lower_limit
    assert not floor.reached(fitted)
    assert quiet[0] > 1.25 * noise


def test_a_triangle_that_repeats_only_nearly_tells_nothing_of_the_noise() -> None:
    fitted, recording = cycled(464.76, sensor=0.05)
    assert (
        from_residual(fitted, recording, 0.0, len(recording), at_once=True).method == "quiet band"
    )


@pytest.mark.parametrize(
    ("states", "effects", "counts"), [(0, 1, True), (0, 0, False), (1, 1, False)]
)
def test_repeats_count_from_the_second_step_on_for_outputs_that_follow_at_once(
    states: int, effects: int, *, counts: bool
) -> None:
    study = SimpleNamespace(
        model=SimpleNamespace(states={"x": None} if states else {}),
        file=SimpleNamespace(effects=[None] * effects),
    )
    assert repeats_at_once(cast("Study", study)) == counts


def repeated(
    levels: tuple[float, ...], step: float = 0.0, periods: tuple[float, ...] = (100,) * 3
) -> tuple[Fit, Recording]:
    """A tone that repeats after 100 samples, in recordings of other sizes and phases.

    What a wrong model leaves of it is a tenth of it.

    Args:
        levels: amplitude of each recording; the next begins a quarter of a period later.
        step: of the converter, which then hides the noise; 0 for noise without a converter.
        periods: of each recording [samples].
    """
    n, draw = np.arange(1000), np.random.default_rng(7)
    every = zip(levels, periods, strict=False)
    tones = [a * np.sin(2 * np.pi * n / p + np.pi / 2 * k) for k, (a, p) in enumerate(every)]
    noise = [NOISE * draw.normal(size=len(n)) for _ in levels]
    outputs = [
        np.round(t / step) * step if step else t + e for t, e in zip(tones, noise, strict=True)
    ]
    left = np.concatenate([y - 0.9 * t for y, t in zip(outputs, tones, strict=True)])[None, :, None]
    runs = [
        Recording(1 / RATE, t[:, None], y[:, None]) for t, y in zip(tones, outputs, strict=True)
    ]
    fitted = SimpleNamespace(residuals=left, rms=np.sqrt(np.mean(left**2, axis=(0, 1))))
    return cast("Fit", fitted), joined(runs)


@pytest.mark.parametrize("levels", [(1.0,), (1.0, 0.2), (1.0, 0.6, 0.3)])
@pytest.mark.parametrize("stated", [False, True])
def test_periods_are_found_and_compared_within_a_recording(
    levels: tuple[float, ...], *, stated: bool
) -> None:
    fitted, recording = repeated(levels)
    floor = from_residual(fitted, recording, stated * 100 / RATE, len(recording))
    assert floor.method == "periods"
    assert floor.rms == pytest.approx([NOISE], rel=0.05)
    assert floor.ratio(fitted) > 5


@pytest.mark.parametrize(("period", "clock"), [(100 / 3, 1.0), (62.5, 1.0), (100.0, 1.0004)])
def test_a_stated_period_need_not_be_whole_samples(period: float, clock: float) -> None:
    fitted, recording = repeated((1.0,), periods=(period,))
    floor = from_residual(fitted, recording, clock * period / RATE, len(recording))
    assert floor.method == "periods"
    assert floor.rms == pytest.approx([NOISE], rel=0.1)


@pytest.mark.parametrize(("periods", "found"), [((50, 125), True), ((100, 143), False)])
def test_recordings_of_several_periods_repeat_after_a_common_one(
    periods: tuple[int, int], found: bool
) -> None:
    fitted, recording = repeated((1.0, 0.5), periods=periods)
    floor = from_residual(fitted, recording, 0.0, len(recording))
    assert (floor.method == "periods") == found
    if found:
        assert floor.rms == pytest.approx([NOISE], rel=0.05)


@pytest.mark.parametrize(("samples", "found"), [(150, True), (500, False)])
def test_only_a_recording_that_holds_two_periods_speaks_against_one(
    samples: int, found: bool
) -> None:
    fitted, recording = repeated((1.0,))
    random = np.random.default_rng(2)
    other = random.normal(size=(samples, 1))
    both = joined([recording, Recording(1 / RATE, other, other)])
    left = NOISE * random.normal(size=(1, samples, 1))
    residuals = np.concatenate([fitted.residuals, left], axis=1)
    fitted = cast("Fit", SimpleNamespace(residuals=residuals, rms=residuals.std(axis=(0, 1))))
    floor = from_residual(fitted, both, 0.0, len(both))
    assert (floor.method == "periods") == found


def test_a_converter_that_hides_the_noise_leaves_what_it_rounds() -> None:
    step = 0.02
    fitted, recording = repeated((1.0,), step)
    floor = from_residual(fitted, recording, 0.0, len(recording))
    assert floor.method == "periods"
    assert floor.rms == pytest.approx([step / np.sqrt(12)], rel=1e-6)


def test_of_a_channel_that_is_not_rounded_nothing_is_taken() -> None:
    _, recording = repeated((1.0,))
    assert np.all(rounding(recording) < 1e-2 * NOISE)
    still = Recording(1 / RATE, recording.inputs, np.full((len(recording), 1), 3.0))
    assert rounding(still) == pytest.approx([0.0])
