"""The model's own error along a motion, by frequency, from its error along the healthy motion."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.noise.error_spectrum import ErrorSpectrum, expected_error, that_count

RANDOM = np.random.default_rng(3)
LENGTH = 4096


def noise(rms: float, low: float, high: float) -> FloatArray:
    """Noise in a band, given in shares of the Nyquist frequency, shape (n, 1)."""
    found = sosfilt(
        butter(4, (low, high), "bandpass", output="sos"), RANDOM.normal(size=2 * LENGTH)
    )
    found = found[LENGTH:, None]
    return np.asarray(rms * found / found.std())


SLOW, FAST = (0.02, 0.15), (0.3, 0.6)
HEALTHY = noise(1.0, *SLOW) + noise(0.05, *FAST)
CORNERED = noise(1.0, *SLOW) + noise(0.3, *FAST)
"""A motion with six times as much at high frequencies as the healthy one."""
ERROR = noise(0.01, *SLOW) + noise(0.03, *FAST)
RMS = ERROR.std(axis=0)


def expected() -> ErrorSpectrum:
    found = expected_error(ERROR[None], HEALTHY, CORNERED)
    assert found is not None
    return found


def test_an_error_that_grows_with_the_motion_in_its_band_is_its_own() -> None:
    left = noise(0.01, *SLOW) + noise(0.15, *FAST)

    assert expected().beyond(left[None], RMS).sum() < 0.1 * (left.std() / RMS[0]) ** 2


def test_the_same_error_where_the_healthy_motion_checks_the_model_is_not() -> None:
    left = noise(0.15, *SLOW) + noise(0.03, *FAST)

    assert expected().beyond(left[None], RMS).sum() > 15


def test_the_bands_of_a_thinned_error_are_those_of_the_motion_at_these_frequencies() -> None:
    # Four samples of the motion to one of the error: a band of it lies four times as low there.
    slow, fast = ((low / 4, high / 4) for low, high in (SLOW, FAST))
    healthy = noise(1.0, *slow) + noise(0.05, *fast)
    cornered = noise(1.0, *slow) + noise(0.3, *fast)
    healthy, cornered = (np.tile(each, (3, 1)) for each in (healthy, cornered))
    found = expected_error(ERROR[None], healthy, cornered, 4)
    assert found is not None
    own = noise(0.01, *SLOW) + noise(0.15, *FAST)

    assert found.beyond(own[None], RMS).sum() < 0.15 * (own.std() / RMS[0]) ** 2


def test_samples_that_do_not_count_hold_nothing() -> None:
    left = noise(0.01, *SLOW)
    left[1000:1010] += 3.0
    calm = np.ones((1, LENGTH), np.bool_)
    calm[0, 1000:1010] = False

    assert expected().beyond(left[None], RMS).sum() > 1
    assert expected().beyond(left[None], RMS, calm).sum() < 0.1


@pytest.mark.parametrize("resting", [0.0, 0.6])
@pytest.mark.parametrize("within", [False, True])
def test_invalid_samples_hold_no_energy_and_take_none_away(resting: float, *, within: bool) -> None:
    """Whether or not they are among those that count."""
    tone = 0.2 * np.sin(0.08 * np.pi * np.arange(LENGTH))[:, None]
    place = np.arange(LENGTH) % 512 / 512
    invalid = place < resting
    calm = (place < resting if within else np.zeros(LENGTH, np.bool_)) | (place >= 0.8)
    left = np.where(invalid[:, None], np.nan, tone)

    whole = expected().beyond(tone[None], RMS).sum()
    assert expected().beyond(left[None], RMS, calm[None]).sum() == pytest.approx(whole, rel=0.15)


def test_a_short_recording_has_no_spectrum() -> None:
    assert expected_error(ERROR[None, :500], HEALTHY, CORNERED) is None
    assert expected().beyond(ERROR[None, :500], RMS).sum() == np.inf


def test_what_rings_above_the_bands_of_what_is_missing_does_not_count() -> None:
    missing = noise(1.0, *SLOW) + noise(0.2, *FAST)
    counts = that_count(expected().beyond(missing[None], RMS))
    ringing, other = (expected().beyond(noise(0.5, *each)[None], RMS) for each in (FAST, SLOW))

    assert ringing[counts].sum() < 0.1 * ringing.sum()
    assert other[counts].sum() > 0.9 * other.sum()


def test_what_is_missing_at_high_frequencies_counts_there() -> None:
    missing = noise(1.0, *SLOW) + noise(1.0, *FAST)

    assert that_count(expected().beyond(missing[None], RMS)).sum() >= 10
