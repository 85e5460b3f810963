"""A drive that stops, from the voltage alone."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import DriveStops
from monitor.signals import GOOD, NEW_BOOT

RATE, N, STOP = 256.0, 3072, 2048
RNG = np.random.default_rng(7)
AT = np.arange(N)
PHASE = 8.0 * AT / RATE
DRIVES = {
    "tone": np.sin(2.0 * np.pi * PHASE),
    "slow tone": np.sin(np.pi * PHASE / 16.0),
    "square": np.where(PHASE % 1.0 < 0.5, 1.0, -1.0),
    "slow square": np.where((PHASE / 8.0) % 1.0 < 0.5, 1.0, -1.0),
    "held": np.sin(2.0 * np.pi * (PHASE - PHASE % 0.125)),
    "noise": RNG.standard_normal(N),
}


def stops(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> np.ndarray:
    code = np.full(signal.size, GOOD)
    code[0] = NEW_BOOT
    drive = DriveStops()
    ends = pairwise((0, *cuts, signal.size))
    return np.concatenate([drive.update(signal[a:b], code[a:b]) for a, b in ends])


@pytest.mark.parametrize("noise", [0.0, 3e-4])
@pytest.mark.parametrize("name", ["tone", "square", "held", "noise"])
@pytest.mark.parametrize("last", [0.0, 0.7])
def test_a_stop_is_seen_within_the_motions_next_swing(name: str, noise: float, last: float) -> None:
    signal = np.where(AT < STOP, DRIVES[name], last) + noise * RNG.standard_normal(N)

    found = np.flatnonzero(stops(signal)[STOP:])

    assert found.size == 1
    assert found[0] < 32


@pytest.mark.parametrize("hertz", [0.15, 0.25, 0.35])
@pytest.mark.parametrize("turn", [0.0, 0.25, 0.6])
def test_a_slow_tone_is_seen_to_stop_and_not_before(hertz: float, turn: float) -> None:
    # Below 0.4 Hz it changes by less than half a percent of its range between samples.
    at = np.arange(6144)
    stop = 4096
    tone = np.sin(2.0 * np.pi * (hertz * at / RATE + turn))

    found = np.flatnonzero(stops(np.where(at < stop, tone, tone[stop])))

    assert not ((found > 1.5 * RATE / hertz) & (found < stop)).any()
    assert 0 <= found[-1] - stop < 32


def test_a_second_stop_is_seen() -> None:
    signal = np.where((AT // 512) % 2 == 0, DRIVES["tone"], 0.0)

    found = np.flatnonzero(stops(signal))

    assert {at // 512 for at in found} >= {1, 3, 5}


@pytest.mark.parametrize("name", list(DRIVES))
def test_a_drive_that_goes_on_does_not_stop(name: str) -> None:
    # A square seems to stop until it has returned once, while nothing is armed yet; a tone of a
    # quarter of a hertz hardly changes between samples, and takes longer.
    begin = 1024 if name == "slow tone" else 256
    assert not stops(DRIVES[name])[begin:].any()


def test_block_sizes_change_no_bit() -> None:
    signal = np.where(AT < STOP, DRIVES["tone"], 0.0)

    assert np.array_equal(stops(signal), stops(signal, (1, 2, 9, 500, 2049, 2053)))
