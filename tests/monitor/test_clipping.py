"""Clipping inside the range is seen, and no healthy signal is called clipped."""

import numpy as np
import pytest
from msgspec import structs

from monitor.commissioning.repeated_readings import chance_of_repeat, step_of
from monitor.pipeline.pipeline import Monitor, Result
from monitor.signals.conditions import DEPARTURE
from rigwatch.wire.messages.message_types import SampleBlock
from sim_plant.excitation import Chirp, Multisine, Recorded, Shape, Silence, Sine, Square, Triangle
from sim_plant.scenario import Event
from tests.monitor.monitor_rig import RATE, SINE, UNITS, active, block, model, run

ONSET = int(4.0 * RATE)
STEP = 0.01
NOISE = tuple(np.random.default_rng(4).standard_normal(9000).clip(-2.5, 2.5) * 0.5)


def cut_off(effect: str, value: float, seconds: float = 10.0, drive: Shape = SINE) -> Result:
    events = (Event(at_s=4.0, effect=effect, value=value),)
    result = Monitor(model()).update(block(run(drive, seconds, events, seed=31)))
    assert result is not None
    return result


def test_peaks_cut_by_little_more_than_the_noise_are_seen() -> None:
    drive = Sine(amplitude=1.5, frequency=4.0)
    result = cut_off("acceleration_saturation", 4.0, drive=drive)
    clipped = np.flatnonzero(active(result, "sensor_clipped.acceleration"))
    assert ONSET < clipped[0] < ONSET + 6 * RATE
    assert not active(result, "sensor_clipped.voltage").any()
    assert not active(result, DEPARTURE).any(), "or this fault needs no look at flat tops"


def test_a_drive_that_is_limited_below_its_noise_is_seen() -> None:
    result = cut_off("voltage_saturation", 0.995, drive=Square(amplitude=1.0, frequency=4.0))
    assert active(result, "sensor_clipped.voltage")[-1] == 1


@pytest.mark.parametrize(
    "drive",
    [
        Sine(amplitude=1.4, frequency=0.5),
        Square(amplitude=0.8, frequency=1.0),
        Triangle(amplitude=1.0, frequency=3.0),
        Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=16.0),
        Multisine(amplitude=1.4, start=0.5, stop=20.0),
        Recorded(samples=NOISE, loop=True),
        Silence(),
    ],
    ids=lambda drive: type(drive).__name__,
)
def test_no_healthy_signal_is_called_clipped(drive: Shape) -> None:
    result = Monitor(model()).update(block(run(drive, 60.0, seed=32)))
    assert result is not None
    names = [c.name for c in result.conditions if c.name.startswith("sensor_clipped")]
    assert names == ["sensor_clipped.voltage", "sensor_clipped.acceleration"]
    for name in names:
        condition = next(c for c in result.conditions if c.name == name)
        assert condition.value.max() < 0.5 * condition.high[0], name


@pytest.mark.parametrize("size", [1, 7, 256])
def test_cutting_into_blocks_changes_no_bit(size: int) -> None:
    channels = run(SINE, 8.0, (Event(at_s=4.0, effect="acceleration_saturation", value=16.0),))
    whole, n = evidence([block(channels)]), len(channels["voltage"])
    parts = [block(channels, k, min(k + size, n)) for k in range(0, n, size)]
    assert np.array_equal(evidence(parts), whole)
    assert whole.max() > 0.0


def evidence(blocks: list[SampleBlock]) -> np.ndarray:
    monitor = Monitor(model())
    results = [monitor.update(one) for one in blocks]
    found = [c for r in results if r for c in r.conditions]
    return np.concatenate([c.value for c in found if c.name == "sensor_clipped.acceleration"])


def test_a_held_reading_is_no_repeat() -> None:
    channels = run(SINE, 6.0, seed=33)
    peaks = np.flatnonzero(channels["acceleration"] > 0.99 * channels["acceleration"].max())
    channels["acceleration"][peaks + 1] = np.nan
    assert evidence([block(channels)]).max() < 3.0


def test_a_reading_that_sticks_at_a_peak_is_not_clipped() -> None:
    channels = run(SINE, 8.0, seed=34)
    start = int(5.0 * RATE)
    peak = start + int(np.argmax(channels["acceleration"][start : start + int(RATE)]))
    channels["acceleration"][peak:] = channels["acceleration"].max()
    result = Monitor(model()).update(block(channels))
    assert result is not None
    assert not active(result, "sensor_clipped.acceleration").any()


def test_a_model_without_the_figures_judges_no_channel() -> None:
    old = structs.replace(model(), noise=structs.replace(model().noise, repeat=()))
    result = Monitor(old).update(block({name: np.ones(600) for name in UNITS}))
    assert result is not None
    assert not [c for c in result.conditions if c.name.startswith("sensor_clipped")]


@pytest.mark.parametrize(
    ("noise", "expected"),
    [(2.0, 0.197), (1.0, 0.383), (0.0, 1.0)],
)
def test_the_chance_of_a_repeat_follows_from_noise_and_step(noise: float, expected: float) -> None:
    random, wave = np.random.default_rng(6), 3.0 * np.sin(2 * np.pi * np.arange(32) / 32)
    values = np.resize(wave, 32 * 400) + noise * STEP * random.standard_normal(32 * 400)
    rounded = STEP * np.round(values / STEP)
    mean = rounded.reshape(-1, 32).mean(axis=0)
    assert chance_of_repeat(rounded, mean) == pytest.approx(expected, rel=0.1)


def test_a_resampled_recording_has_no_step() -> None:
    values = np.random.default_rng(7).standard_normal(5000)
    assert step_of(values) == 0.0
    assert chance_of_repeat(values, np.zeros(10)) == 1.0
    assert step_of(STEP * np.round(values / STEP)) == pytest.approx(STEP)
