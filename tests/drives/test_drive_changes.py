"""A drive's frequency and its sudden changes, from the voltage alone."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import Drive, DriveChanges
from monitor.signals import GOOD, NEW_BOOT

RATE, N, CHANGE = 256.0, 3072, 2048
RNG = np.random.default_rng(7)
AT = np.arange(N)


def followed(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> Drive:
    code = np.full(signal.size, GOOD)
    code[0] = NEW_BOOT
    drive = DriveChanges()
    parts = [drive.update(signal[a:b], code[a:b]) for a, b in pairwise((0, *cuts, signal.size))]
    return Drive(*map(np.concatenate, zip(*parts, strict=True)))


def tone(frequency: np.ndarray | float) -> np.ndarray:
    return 1.4 * np.sin(2.0 * np.pi * np.cumsum(np.broadcast_to(frequency, N)) / RATE)


def square(frequency: float) -> np.ndarray:
    return np.where(frequency * AT / RATE % 1.0 < 0.5, 1.0, -1.0)


def triangle(frequency: float) -> np.ndarray:
    return np.arcsin(np.sin(2.0 * np.pi * frequency * AT / RATE))


@pytest.mark.parametrize("factor", [0.85, 1.2])
@pytest.mark.parametrize("noise", [0.0, 3e-3])
def test_another_frequency_is_a_change(factor: float, noise: float) -> None:
    signal = tone(np.where(AT < CHANGE, 8.0, 8.0 * factor)) + noise * RNG.standard_normal(N)

    changed = np.flatnonzero(followed(signal).changed)

    assert CHANGE <= changed[0] < CHANGE + 48


@pytest.mark.parametrize("factor", [0.8, 1.25])
@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("what", ["frequency", "amplitude"])
def test_a_change_of_a_tone_is_seen_before_the_motion_differs(
    what: str, factor: float, noise: float
) -> None:
    ratio = np.where(AT < CHANGE, 1.0, factor)
    signal = tone(8.0 * ratio) if what == "frequency" else ratio * tone(8.0)

    changed = np.flatnonzero(followed(signal + noise * RNG.standard_normal(N)).changed)

    assert CHANGE <= changed[0] < CHANGE + 6


@pytest.mark.parametrize(
    "signal",
    [
        tone(8.0),
        tone(4.0) + 3e-3 * RNG.standard_normal(N),
        tone(np.linspace(3.0, 9.0, N)),
        triangle(8.03),
        square(7.97),
        tone(8.0) * np.linspace(0.2, 1.0, N),
        np.zeros(N),
    ],
    ids=["tone", "noisy", "sweep", "triangle", "square", "growing", "rest"],
)
def test_steady_drives_do_not_change(signal: np.ndarray) -> None:
    assert not followed(signal).changed.any()


def test_pace_tells_drives_of_one_frequency_apart() -> None:
    paces = [followed(each).pace[-1] for each in (tone(8.0), triangle(8.0), square(8.0))]

    assert paces[0] == pytest.approx(2.0 * np.sin(2.0 * 2.0 * np.pi * 8.0 / RATE), rel=1e-3)
    assert paces[1] > 1.03 * paces[0]
    assert paces[2] > 1.1 * paces[1]


def test_block_sizes_change_no_bit() -> None:
    signal = tone(np.where(AT < CHANGE, 8.0, 6.0))

    whole, parts = followed(signal), followed(signal, (1, 2, 9, 500, 2049, 2100))

    assert np.array_equal(whole.changed, parts.changed)
    assert np.array_equal(whole.pace, parts.pace)
