"""Drive voltages: peaks, spectra, no dependence on cuts."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ConfigError
from sim_plant.excitation import (
    SHAPES,
    Chirp,
    Multisine,
    Recorded,
    Shape,
    Silence,
    Sine,
    Square,
    Triangle,
    drive,
)

RATE = 256.0
EXAMPLES: list[Shape] = [
    Sine(amplitude=1.4, frequency=8.0),
    Square(amplitude=1.4, frequency=8.0),
    Triangle(amplitude=1.4, frequency=8.0),
    Chirp(amplitude=1.4, start=0.5, stop=20.0, length_s=16.0),
    Multisine(amplitude=1.4, start=0.5, stop=20.0),
    Recorded(samples=tuple(np.sin(np.arange(500)) * 1.4), loop=True),
    Silence(),
]


def numbers(start: int, stop: int) -> np.ndarray:
    return np.arange(start, stop, dtype=np.int64)


def test_every_shape_has_an_example_here():
    assert {type(example) for example in EXAMPLES} == set(SHAPES)


@pytest.mark.parametrize("shape", EXAMPLES, ids=lambda shape: type(shape).__name__)
def test_any_cut_gives_the_same_volts(shape: Shape):
    volts = drive(shape, RATE, begins=-300)
    whole = volts(numbers(-300, 5000))
    parts = [volts(numbers(a, b)) for a, b in ((-300, -7), (-7, 130), (130, 131), (131, 5000))]
    assert np.array_equal(whole, np.concatenate(parts))


@pytest.mark.parametrize("shape", EXAMPLES, ids=lambda shape: type(shape).__name__)
def test_peak_is_the_amplitude_and_the_start_is_soft(shape: Shape):
    whole = drive(shape, RATE)(numbers(0, 4096 * 2))
    assert whole[0] == 0.0
    peak = 0.0 if isinstance(shape, Silence) else 1.4
    assert np.abs(whole[256:]).max() == pytest.approx(peak, rel=0.02)


def test_multisine_has_its_lines_only_and_repeats():
    shape = Multisine(amplitude=1.0, start=0.5, stop=20.0, odd_only=True, ramp_s=0.0)
    volts = drive(shape, RATE)(numbers(0, 8192))
    assert np.array_equal(volts[:4096], volts[4096:])
    spectrum = np.abs(np.fft.rfft(volts[:4096]))
    lines = shape.lines(RATE)
    assert np.ptp(spectrum[lines]) < 1e-9 * spectrum.max()
    assert np.delete(spectrum, lines).max() < 1e-9 * spectrum.max()
    assert np.all(lines % 2 == 1)
    assert np.abs(volts).max() / volts.std() < 3.2


def test_chirp_of_whole_cycles_repeats_without_a_jump():
    volts = drive(EXAMPLES[3], RATE)(numbers(0, 4096 * 2 + 64))
    largest = 1.4 * 2 * np.pi * 20.0 / RATE
    assert np.abs(np.diff(volts[200:])).max() <= largest
    assert np.allclose(volts[4096 + 128 :], volts[128 : 4096 + 64])


def test_recorded_file_is_played_once(tmp_path: Path):
    file = tmp_path / "volts.csv"
    file.write_text("0.1\n0.2\n-0.3\n")
    volts = drive(Recorded(file=str(file), gain=2.0, ramp_s=0.0), RATE)(numbers(-2, 5))
    assert volts.tolist() == [0.0, 0.0, 0.2, 0.4, -0.6, 0.0, 0.0]


@pytest.mark.parametrize("text", ["", "a\n", "1,2\n3,4\n", "nan\n"])
def test_bad_recorded_file_is_reported(tmp_path: Path, text: str):
    file = tmp_path / "volts.csv"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"volts\.csv"):
        drive(Recorded(file=str(file)), RATE)


def test_recorded_needs_one_source():
    with pytest.raises(ConfigError, match="file and samples"):
        drive(Recorded(), RATE)


def test_missing_recorded_file_is_reported(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"no\.csv"):
        drive(Recorded(file=str(tmp_path / "no.csv")), RATE)
