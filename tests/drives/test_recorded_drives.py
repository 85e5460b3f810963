"""A drive that was recorded is told from another one by the energies of its bands."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import DriveBands, RecordedDrives, steady_energies
from monitor.signals import GOOD, NEW_BOOT

RATE, N = 256.0, 2048
AT = np.arange(N)


def tone(volts: float, frequency: float) -> np.ndarray:
    return volts * np.sin(2.0 * np.pi * frequency * AT / RATE)


def energies(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> np.ndarray:
    code = np.full(signal.size, GOOD)
    code[0] = NEW_BOOT
    bands = DriveBands()
    ends = pairwise((0, *cuts, signal.size))
    return np.concatenate([bands.update(signal[a:b], code[a:b]) for a, b in ends])


SQUARE = np.sign(tone(1.0, 8.0))
SETTLED = N // 2
KNOWN = RecordedDrives(
    (
        *steady_energies(energies(tone(1.4, 8.0))[SETTLED:]),
        *steady_energies(energies(SQUARE)[SETTLED:]),
    )
)


@pytest.mark.parametrize(
    ("signal", "recorded"),
    [
        (tone(1.4, 8.0), True),
        (tone(1.4, 8.0 * 1.011), True),
        (tone(1.4, 8.0) + 3e-3 * np.random.default_rng(7).standard_normal(N), True),
        (SQUARE, True),
        (tone(1.7, 8.0), False),
        (tone(1.1, 8.0), False),
        (tone(1.4, 6.5), False),
        (0.8 * SQUARE, False),
        (np.zeros(N), False),
    ],
    ids=["same", "own clock", "noisy", "square", "larger", "smaller", "slower", "weaker", "rest"],
)
def test_drive_is_compared_with_those_recorded(signal: np.ndarray, recorded: bool) -> None:
    assert (KNOWN.contain(energies(signal))[SETTLED:] == recorded).all()


def test_sweep_and_rest_are_no_steady_drives() -> None:
    sweep = 1.4 * np.sin(2.0 * np.pi * np.cumsum(np.linspace(1.0, 20.0, N)) / RATE)

    assert steady_energies(energies(sweep)) == ()
    assert steady_energies(energies(np.zeros(N))) == ()
    assert not RecordedDrives(()).contain(energies(sweep)).any()


def test_block_sizes_change_no_bit() -> None:
    assert np.array_equal(energies(SQUARE), energies(SQUARE, (1, 2, 9, 500)))
