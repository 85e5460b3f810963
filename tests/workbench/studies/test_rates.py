"""Recordings of one rig whose loggers are not clocked together."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.model import Model
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.data.columns import Columns
from rigwatch.workbench.data.noise.quietest_band import quietest_band
from rigwatch.workbench.data.one_rate import RESAMPLED, resampled
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.explain.explain import explain
from tests.workbench.machine import studied

LINE = """
name = "line"
summary = "A force that grows with position."
inputs.position = { unit = "m" }
parameters.k = { unit = "N/m" }
outputs.force = { unit = "N", expression = "k*position + load" }
ports.load = { kind = "force", unit = "N", variables.x = { expression = "position", unit = "m" } }
"""
UNITS = {"position": "m", "force": "N"}


def waves(rate: float, seed: int, seconds: float = 8.0) -> dict[str, np.ndarray]:
    time = np.arange(round(seconds * rate)) / rate
    position = np.sin(9 * time) + 0.3 * np.sin(31 * time + seed)
    noise = np.random.default_rng(seed).normal(size=len(time))
    return {"position": position, "force": 3 * position + 0.01 * noise}


MASS = """
name = "mass"
summary = "A mass on a damper, pushed by what a converter holds from sample to sample."
inputs.force = { unit = "N", hold = "zero" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(drive - c*v)/m", rate_of = "position" }
parameters.m = { unit = "kg", low = 1e-3 }
parameters.c = { unit = "N s/m", low = 0.0 }
outputs.position = { unit = "m", expression = "x" }
ports.drive = { kind = "actuator", signal = "force" }
"""
NOISE = 2e-4


def pushed(
    rate: float,
    seed: int,
    mass: float = 0.8,
    damper: float = 1.5,
    *,
    late: float = 0.0,
    noise: float = NOISE,
) -> dict[str, np.ndarray]:
    """Position in closed form after steps of the force, which acts late [s]."""
    rng, count = np.random.default_rng(seed), round(10 * rate)
    force = np.repeat(rng.normal(size=count), 7)[:count]
    since = np.maximum((np.arange(count)[:, None] - np.arange(count)) / rate - late, 0.0)
    settling = (1 - np.exp(-damper / mass * since)) * mass / damper
    position = (since - settling) / damper @ np.diff(force, prepend=0.0)
    return {"force": force, "position": position + noise * rng.normal(size=count)}


def test_loggers_that_differ_by_parts_of_a_percent_keep_their_rates(tmp_path: Path) -> None:
    train, held_out = waves(188.8, 0), waves(188.1, 1)
    found = compare(studied(tmp_path, LINE, [train], [held_out], UNITS, rates=(188.8, 188.1)))
    assert found.parameters["k"].value == pytest.approx(3.0, rel=1e-3)
    assert found.held_out_error == pytest.approx(0.01, rel=0.1)
    assert "2 recordings of 188.1 to 188.8 Hz, each at its own rate" in found.remarks


def test_what_is_held_changes_at_the_samples_of_each_recording(tmp_path: Path) -> None:
    rates = (100.0, 101.3, 100.7)
    one, other, last = (pushed(rate, seed) for seed, rate in enumerate(rates))
    units = {"force": "N", "position": "m"}
    study = studied(tmp_path, MASS, [one, other], [last], units, "horizon = 1.0", rates)
    data = prepare(study)
    assert data.train.own_spacings == pytest.approx([1 / rate for rate in rates[:2]], rel=1e-6)
    assert data.held_out.dt == pytest.approx(1 / rates[2], rel=1e-6)
    assert not data.altered
    found = compare(study)
    # On one rate the force would change between samples, and most of the error would be that.
    assert found.train_error < 1.03 * NOISE
    assert found.held_out_error < 1.06 * NOISE
    assert found.parameters["m"].value == pytest.approx(0.8, rel=2e-3)


@pytest.mark.nightly
def test_a_late_drive_is_found_though_its_sensor_may_be_late_instead(tmp_path: Path) -> None:
    rates, late = (100.0, 101.3, 100.7), 0.0237
    one, other, last = (
        pushed(rate, seed, late=late, noise=1e-5) for seed, rate in enumerate(rates)
    )
    model = MASS + 'ports.sensor = { kind = "sensor", signal = "position" }'
    units = {"force": "N", "position": "m"}
    found = explain(studied(tmp_path, model, [one, other], [last], units, "horizon = 1.0", rates))
    assert found.verdict == "missing_effect"
    first = found.ranking[0]
    named = {f"{first.effect}@{first.port}", *first.class_}
    assert {"delay@drive", "delay@sensor"} <= named
    assert first.parameters["tau"].value == pytest.approx(late, rel=0.01)
    (drive,) = (row for row in found.ranking if (row.effect, row.port) == ("delay", "drive"))
    assert drive.held_out_error is not None
    assert drive.held_out_error < 1.1 * 1e-5, "held inputs are delayed exactly"


def test_where_the_study_counts_periods_recordings_are_put_on_the_slowest_rate(
    tmp_path: Path,
) -> None:
    one, last = pushed(101.3, 0), pushed(100.0, 1)
    units = {"force": "N", "position": "m"}
    study = studied(tmp_path, MASS, [one], [last], units, "period = 1.0", (101.3, 100.0))
    data = prepare(study)
    assert data.train.dt == data.held_out.dt == pytest.approx(0.01, rel=1e-6)
    assert data.altered == (RESAMPLED,)
    assert "../train0.mcap: 101.3 Hz, resampled to 100 Hz" in data.remarks


def test_others_are_put_on_the_rate_that_the_study_says(tmp_path: Path) -> None:
    train, held_out = waves(500.0, 0), waves(200.0, 1)
    given = (LINE, [train], [held_out], UNITS)
    with pytest.raises(ModelError, match=r"found 200 Hz, expected 500 Hz.*`rate = 200` in"):
        compare(studied(tmp_path / "a", *given, rates=(500.0, 200.0)))
    found = compare(studied(tmp_path / "b", *given, "rate = 100", rates=(500.0, 200.0)))
    assert found.parameters["k"].value == pytest.approx(3.0, rel=1e-3)
    with pytest.raises(ModelError, match="rate: found 300 Hz, expected at most 200 Hz"):
        compare(studied(tmp_path / "c", *given, "rate = 300", rates=(500.0, 200.0)))


def test_the_floor_of_a_low_passed_recording_is_that_of_the_band_that_passes() -> None:
    noise = np.random.default_rng(2).normal(size=20000)
    made = resampled(Columns(1e-3, {"y": noise}), 500.0)
    density = np.sqrt(1e-3)
    rms, _ = quietest_band([made.values["y"]], 500.0, made.passed)
    assert rms == pytest.approx(density * np.sqrt(500.0), rel=0.08)


@pytest.mark.parametrize("rate", [999.9, 990.0, 960.0])
def test_the_floor_of_interpolated_noise_is_no_lower_than_the_noise(rate: float) -> None:
    noise = np.random.default_rng(5).normal(size=20000)
    made = resampled(Columns(1e-3, {"y": noise}), rate)
    floor, _ = quietest_band([made.values["y"]], rate, made.passed)
    # Interpolation takes noise from the upper bands: the quietest of all has 0.8 times as much.
    assert made.values["y"].std() == pytest.approx(floor, rel=0.06)


def test_what_the_new_rate_cannot_show_is_filtered_away() -> None:
    time = np.arange(4000) / 1000
    low, high = np.sin(2 * np.pi * 5 * time), np.sin(2 * np.pi * 97 * time)
    made = resampled(Columns(1e-3, {"both": low + high}), 100.0)
    inner = slice(20, -20)
    at = np.arange(len(made)) / 100
    error = (made.values["both"] - np.sin(2 * np.pi * 5 * at))[inner]
    # Unfiltered it comes back as 3 Hz, as large as it was.
    assert np.sqrt(np.mean(error**2)) < 0.01


def test_a_held_signal_becomes_its_mean_over_each_new_interval_and_holes_stay_holes() -> None:
    stairs = np.repeat([0.0, 1.0, -2.0], 50)
    holed = np.where((np.arange(150) > 70) & (np.arange(150) < 80), np.nan, 1.0)
    columns = Columns(0.01, {"u": stairs, "v": holed, "y": holed})
    made = resampled(columns, 60.0, frozenset({"u", "v"}))
    u = made.values["u"]
    assert np.isin(u, [0.0, 1.0, -2.0]).sum() == len(u) - 1, "one step falls inside an interval"
    np.testing.assert_allclose(u.sum() / 60, stairs.sum() / 100, atol=0.01)
    assert np.isnan(made.values["v"][43:47]).all()
    np.testing.assert_allclose(made.values["v"][:42], 1.0)
    halved = resampled(Columns(0.01, {"u": np.array([0.0, 2.0, 4.0, 5.0])}), 50.0, frozenset({"u"}))
    assert halved.values["u"].tolist() == [1.0, 4.5]
    assert np.isnan(made.values["y"][44:47]).all()
    assert np.isfinite(made.values["y"][:42]).all()


def test_a_parameter_needs_no_starting_value_unless_it_is_fixed() -> None:
    values = {"": 1.0, ", low = 4.0": 8.0, ", low = 1.0, high = 100.0": 10.0, ", high = -3.0": -6.0}
    for bounds, value in values.items():
        text = LINE.replace('"N/m" }', f'"N/m"{bounds} }}')
        assert parse(text, Model, "line.toml").parameters["k"].value == pytest.approx(value)
    with pytest.raises(ConfigError, match="expected a value, as it is fixed"):
        parse(LINE.replace('"N/m" }', '"N/m", fixed = true }'), Model, "line.toml")
