"""Up to which frequency equations describe healthy recordings."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.commissioning.equations.described import Left, described, with_pauses
from monitor.observer import EMPTY, FIRST, MEASURED, E, Observed
from monitor.observer.lagged_motion import WHOLE
from monitor.observer.prediction import PAUSE, Predicted
from rigwatch.wire.errors import ModelError

RATE, SECONDS = 256.0, 40
N = round(RATE * SECONDS)


def recording(role: str, pace: np.ndarray, share: np.ndarray) -> Left:
    """A recording of which the share `share` is left at each sample."""
    judged = np.zeros((N, 6))
    judged[:, MEASURED] = np.random.default_rng(3).standard_normal(N)
    judged[:, E] = share * judged[:, MEASURED]
    return Left(role, role, judged, pace, 0.0)


def sweep(worst: float, above: float = 12.0) -> Left:
    """From 1 to 20 Hz, with a residual that grows above a frequency."""
    pace = np.linspace(1.0, 20.0, N)
    return recording("chirp", pace, 0.03 + worst * np.clip(pace - above, 0.0, 2.0) / 2.0)


def tone(hertz: float, share: float = 0.03) -> Left:
    return recording("healthy", np.full(N, hertz), np.full(N, share))


def diverging(every: int, share: float = 0.03) -> Observed:
    """A tone whose equations diverge after so many samples, and begin anew after a pause."""
    one, place = tone(8.0, share), np.arange(N)
    state, reset = np.full(N, WHOLE), place % every == every - 1
    for end in np.flatnonzero(reset):
        state[end : end + PAUSE] = EMPTY
        state[end + PAUSE : end + PAUSE + 1] = FIRST
    state[0] = FIRST
    measured, judged = one.judged[:, MEASURED] + 0.5, one.judged.copy()
    judged[state == EMPTY] = 0.0
    none = np.zeros((N, 0))
    predicted = Predicted(none, none, reset)
    return Observed(state, none, measured, predicted, judged, none, none, none, none)


@pytest.mark.parametrize(("every", "left"), [(4000, 0.08), (400, 0.29), (80, 0.63)])
def test_equations_that_diverge_describe_nothing_until_they_begin_anew(
    every: int, left: float
) -> None:
    seen = diverging(every)
    found = replace(tone(8.0), judged=with_pauses(seen))

    assert found.share(0, N) == pytest.approx(left, rel=0.1)
    if left > 0.2:
        with pytest.raises(ModelError, match="of a healthy recording"):
            described([found], "rig", RATE)
    assert np.array_equal(with_pauses(diverging(N + 1)), diverging(N + 1).judged)


def test_what_is_described_is_kept_whole() -> None:
    found = described([sweep(0.1), tone(8.0)], "rig", RATE)

    assert found.parts == ((0, N), (0, N))
    assert found.fastest == 0.0


def test_fast_motion_that_is_not_described_is_left_out() -> None:
    found = described([sweep(0.4), tone(8.0), tone(16.0)], "rig", RATE)

    assert 12.0 < found.fastest < 14.0
    begin, end = found.parts[0]
    assert begin == 0
    assert end == pytest.approx(N * (found.fastest - 1.0) / 19.0, abs=RATE)
    assert found.parts[1] == (0, N)
    assert found.parts[2] == (0, 0)
    # Nothing of the sweep's held-out part is kept: all that is kept of it is judged.
    assert found.share == pytest.approx(0.039, rel=0.05)


def test_of_a_sweep_that_becomes_slow_late_only_the_slow_end_is_judged() -> None:
    one = sweep(0.9, above=4.0)
    down = replace(one, judged=one.judged[::-1].copy(), pace=one.pace[::-1].copy())

    found = described([down, tone(4.0)], "rig", RATE)

    assert 4.0 <= found.fastest < 5.0
    begin, end = found.parts[0]
    assert begin > down.held_out
    assert end == N
    assert found.share < 0.1


def test_noise_at_the_slow_end_of_a_sweep_does_not_count() -> None:
    one = sweep(0.4)
    one.judged[: N // 10, E] = 0.5 * one.judged[: N // 10, MEASURED]

    assert 12.0 < described([one, tone(8.0)], "rig", RATE).fastest < 14.0


def test_a_strong_drive_speaks_for_its_frequency_beside_a_weak_sweep() -> None:
    weak, strong = recording("chirp", np.linspace(1.0, 20.0, N), np.full(N, 0.19)), tone(8.0)
    weak.judged[-N // 3 :, E] *= 1.3
    strong.judged[:] *= 10.0

    found = described([weak, strong], "rig", RATE)

    assert 8.0 <= found.fastest < 9.7
    assert found.parts[1] == (0, N)
    # What is kept of the sweep ends before its held-out part, and is judged all the same.
    assert found.share == pytest.approx(0.19, rel=0.05)


@pytest.mark.parametrize("noise", [0.25, 0.5])
def test_noise_of_the_sensor_in_a_weak_sweep_refuses_no_rig(noise: float) -> None:
    weak = replace(sweep(0.05), noise=noise)
    weak.judged[:, E] += noise * np.random.default_rng(4).standard_normal(N)

    found = described([weak, replace(tone(8.0), noise=noise)], "rig", RATE)

    assert found.parts == ((0, N), (0, N))
    assert found.share < 0.12


def test_a_sensor_that_shows_only_noise_refuses_a_rig() -> None:
    one = replace(tone(8.0, 0.99), noise=1.0)

    with pytest.raises(ModelError, match="leave 99 %"):
        described([one], "rig", RATE)


def test_noise_hides_no_fast_motion_that_is_not_described() -> None:
    one = replace(sweep(0.4), noise=0.25)
    one.judged[:, E] += 0.25 * np.random.default_rng(4).standard_normal(N)

    assert 12.0 < described([one, replace(tone(8.0), noise=0.25)], "rig", RATE).fastest < 14.0


def test_a_sweep_that_is_not_described_anywhere_refuses_a_rig() -> None:
    weak, strong = recording("chirp", np.linspace(1.0, 20.0, N), np.full(N, 0.4)), tone(8.0)
    strong.judged[:] *= 20.0

    with pytest.raises(ModelError, match="chirp: the equations of rig leave 40 %"):
        described([weak, strong], "rig", RATE)


@pytest.mark.parametrize(
    "recordings",
    [
        [sweep(0.4, above=0.0), tone(8.0, 0.4)],
        [sweep(0.4, above=6.0), tone(8.0)],
        [sweep(0.4), tone(8.0, 0.4)],
    ],
    ids=["nothing", "no healthy recording", "a slow recording"],
)
def test_equations_that_describe_nothing_of_use_are_refused(recordings: list[Left]) -> None:
    with pytest.raises(ModelError, match=r"leave \d+ % of a healthy recording"):
        described(recordings, "rig", RATE)
