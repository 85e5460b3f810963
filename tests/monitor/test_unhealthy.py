"""A healthy recording that is not healthy is refused with its name."""

import numpy as np
import pytest

from monitor.commissioning.unhealthy import check_healthy, check_moves
from monitor.signals.recordings import recording_of
from rigwatch.wire.errors import ModelError

RATE, SAMPLES = 256.0, 5120


def part(seed: int, friction: float = 0.0, since: int = 0, noise: float = 0.2) -> np.ndarray:
    """Judged columns of a 0.23 kg mass at 8 Hz, with dry friction [N] from a sample on."""
    rng = np.random.default_rng(seed)
    speed = np.sin(2.0 * np.pi * 8.0 * np.arange(SAMPLES) / RATE)
    dry = -np.sign(speed) / 0.23
    judged = np.zeros((SAMPLES, 6))
    judged[:, 1] = dry
    judged[:, 0] = noise * rng.standard_normal(SAMPLES) + 0.1 * speed
    judged[since:, 0] += friction * dry[since:]
    return judged


def test_friction_that_sets_in_is_reported_with_its_time_and_noise_is_not() -> None:
    check_healthy(["a", "b", "c"], [part(1), part(2, noise=0.4), part(3)], RATE)
    with pytest.raises(ModelError, match=r"b: found friction of about 0\.5.* about 10 s after"):
        check_healthy(["a", "b"], [part(1), part(2, 0.5, 2560)], RATE)


def test_more_friction_in_one_recording_is_reported_and_equal_friction_in_all_is_not() -> None:
    check_healthy(["a", "b", "c"], [part(k, 0.3) for k in range(3)], RATE)
    with pytest.raises(ModelError, match=r"c: found about 0\.5.* more friction than"):
        check_healthy(["a", "b", "c"], [part(1), part(2), part(3, 0.5)], RATE)


def test_a_recording_too_short_for_an_estimate_leaves_the_others_judged() -> None:
    # Five seconds at 100 Hz, of which nothing is left once it has settled.
    brief = part(4)[:500]
    with pytest.raises(ModelError, match=r"c: found about 0\.5.* more friction than"):
        check_healthy(["a", "b", "c", "d"], [part(1), brief, part(3, 0.5), part(2)], 100.0)
    check_healthy(["a", "b", "c", "d"], [part(1), brief, part(2), part(3)], 100.0)


def test_a_short_recording_is_refused_with_what_to_do() -> None:
    moving = recording_of("healthy", "brief", RATE, {"position": np.sin(np.arange(512) / 5.0)})

    with pytest.raises(ModelError, match=r"brief: found 2\.0 s .* at least 5 s .*record longer"):
        check_moves([moving], ["position"])


def test_at_a_slow_rate_a_recording_holds_the_windows_of_which_limits_are_the_largest() -> None:
    moving = recording_of("healthy", "slow", 10.0, {"position": np.sin(np.arange(60) / 2.0)})

    with pytest.raises(ModelError, match=r"slow: found 6\.0 s .* at least 8\.4 s .*record longer"):
        check_moves([moving], ["position"])


def test_a_recording_at_rest_is_refused_with_its_channel_and_ordinary_motion_is_not() -> None:
    rng = np.random.default_rng(4)
    noise = 1e-5 * rng.standard_normal(SAMPLES)
    still, moving = 0.02 + noise, 1e-3 * np.sin(np.arange(SAMPLES) / 5.0) + noise

    check_moves([recording_of("healthy", "sine", RATE, {"position": moving})], ["position"])
    with pytest.raises(ModelError, match="rest: found no motion in position"):
        check_moves([recording_of("healthy", "rest", RATE, {"position": still})], ["position"])
