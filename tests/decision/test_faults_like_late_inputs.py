"""Inputs that act later shift the motion; a fault that leaves the same residual changes it."""

import numpy as np
import pytest

from monitor.model import BANDS, HealthyLimits
from monitor.observer import (
    Extremes,
    SpectralWidth,
    Spectrum,
    UsualError,
    decide,
    new_state,
    steady_motion,
)
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import (
    DRY_BARE,
    DRY_UNIT,
    HELD_LATE,
    JUDGED,
    LATE_UNIT,
    VISCOUS_UNIT,
    E,
)
from rigwatch.wire.arrays import FloatArray

RATE, N, SLOW, NOISE = 256.0, 3072, 1e-3, 0.05
PHASE = 2.0 * np.pi * 8.0 * np.arange(N) / RATE
SIZE, SECOND, ANGLE = 0.2, 0.05, 0.6
"""Of the recorded speed: amplitude, its second harmonic's share, and that one's phase."""
BANDS_OF_DRIVE = np.array([0.0, 0.1, 0.3, 0.1, 0.0, 0.0, 0.0])
PACE = np.full(N, 0.765)
RULES = d.DecisionRules(NOISE, np.zeros(1), 9.0, 5.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 1.6**2)
USUAL = Extremes(lasting=1.4, short=3.3, medium=1.9, friction=4.2, onset=4.2)


def moved(late: float = 0.0, size: float = SIZE, second: float = SECOND) -> Spectrum:
    """Spectrum of a speed with a second harmonic, late by some samples."""
    phase = PHASE - late * 2.0 * np.pi * 8.0 / RATE
    state = np.full(N, WHOLE)
    state[0] = FIRST
    speed = size * (np.cos(phase) + second * np.cos(2.0 * phase + ANGLE))
    return SpectralWidth(SLOW, RATE).update(speed, state)


def limits(*, with_shape: bool = True) -> HealthyLimits:
    """Of a rig with one recorded motion."""
    after = Spectrum(*(figure[512:] for figure in moved()))
    known = steady_motion(after, PACE[512:], USUAL, RATE, tuple(BANDS_OF_DRIVE.tolist()))
    assert known is not None
    return HealthyLimits(
        noise=NOISE, growth=(0.0,), short=1.0, medium=1.0, friction=1.0, sensor_noise=1.0,
        sensor_growth=0.0, sensor=1.0, speed_noise=SLOW,
        steady_paces=(known.pace,), steady_sizes=(known.size,), steady_narrow=(known.narrow,),
        steady_drives=(known.drive,), steady_energies=(USUAL.lasting,),
        steady_motion_bands=known.bands, steady_skews=known.shape if with_shape else (),
    )  # fmt: skip


def altered(seen: Spectrum, known: HealthyLimits | None = None, volts: float = 1.0) -> FloatArray:
    """What a motion differs by from the recorded one, once it has settled."""
    bands = np.tile(volts**2 * BANDS_OF_DRIVE, (N, 1))
    assert bands.shape[1] == BANDS
    return UsualError(known or limits(), RATE).update(seen, PACE, bands).altered[1536:]


def test_skewnesses_are_those_of_the_second_harmonic_wherever_the_motion_begins() -> None:
    expected = 0.75 * SECOND * np.cos(ANGLE) / ((1.0 + SECOND**2) / 2.0) ** 1.5

    for late in (0.0, 0.4, 7.0):
        seen = moved(late)
        assert np.mean(seen.skew[-1024:]) == pytest.approx(expected, rel=0.02)
        # Of the derivative, -sin(x) - 2·s·sin(2x + angle), to first order in s.
        assert np.mean(seen.skew_rate[-1024:]) == pytest.approx(
            1.5 * SECOND * np.sin(ANGLE) * 2**1.5, rel=0.05
        )


@pytest.mark.parametrize("late", [-1.0, 0.5, 1.0])
def test_a_motion_that_is_late_is_the_recorded_one(late: float) -> None:
    assert np.all(altered(moved(late)) < 0.5)


@pytest.mark.parametrize(
    ("size", "second", "differs"),
    [(0.98, 1.0, False), (0.96, 1.0, True), (1.04, 1.0, True), (1.0, 0.95, False),
     (1.0, 0.75, True), (0.975, 0.87, True)],
)  # fmt: skip
def test_a_motion_of_another_size_or_shape_is_another_one(size, second, differs) -> None:
    found = altered(moved(1.0, size * SIZE, second * SECOND))

    assert np.all((found > 1.0) == differs)


def test_a_model_file_without_shapes_compares_sizes_alone() -> None:
    older = limits(with_shape=False)

    assert np.all(altered(moved(1.0, second=0.5 * SECOND), older) < 1.0)
    assert np.all(altered(moved(1.0, size=0.95 * SIZE), older) > 1.0)


def test_nothing_is_compared_under_a_drive_that_was_not_recorded() -> None:
    assert not np.any(altered(moved(size=0.95 * SIZE), volts=1.5))


def decided(late: float, off: float, friction: float = 0.0) -> FloatArray:
    """The decision on a residual like that of late inputs, which friction may join after 8 s.

    Args:
        late: by which the inputs seem to be late [samples].
        off: what the motion differs by from the recorded one.
        friction: as what it leaves of the residual.
    """
    judged, speed = np.zeros((N, JUDGED)), np.sin(PHASE + 0.1)
    judged[:, LATE_UNIT] = judged[:, HELD_LATE] = 0.5 * np.cos(PHASE)
    judged[:, DRY_UNIT] = judged[:, DRY_BARE] = -np.sign(speed)
    judged[:, VISCOUS_UNIT] = -speed
    judged[:, E] = NOISE * np.random.default_rng(1).standard_normal(N) + late * judged[:, LATE_UNIT]
    judged[2048:, E] += friction * judged[2048:, DRY_UNIT]
    state = np.full(N, WHOLE)
    state[0] = FIRST
    # Under friction the motion becomes smaller.
    differs = np.full(N, off) + np.where((np.arange(N) > 2100) & (friction > 0.0), 2.0, 0.0)
    yes, no, out = np.ones(N, np.bool_), np.zeros(N, np.bool_), np.zeros((len(d.OUTPUTS), N))
    decide(
        judged, speed, np.zeros((N, 1)), np.ones(N), yes, no, yes,
        np.tile(np.array(USUAL)[:, None], N), np.zeros(N), differs, state, RULES, new_state(1), out,
    )  # fmt: skip
    return out


@pytest.mark.parametrize("late", [-0.7, 0.9])
def test_a_lateness_of_a_motion_that_is_another_one_is_another_fault(late: float) -> None:
    out = decided(late, 1.5)

    assert out[d.VERDICT, -1] == d.OTHER
    assert not np.any(out[d.VERDICT] == d.FRICTION)
    assert not np.any(out[d.FOUND_LATE, -256:])


@pytest.mark.parametrize(("off", "after"), [(2.5, 384), (1.5, 577), (1.1, 730)])
def test_the_more_a_motion_differs_the_sooner_the_lateness_is_denied(
    off: float, after: int
) -> None:
    told = np.flatnonzero(decided(0.9, off)[d.FOUND_LATE])

    assert told[-1] == after - 2


def test_inputs_cannot_be_later_than_a_held_voltage() -> None:
    out = decided(1.2, 0.5)

    assert out[d.VERDICT, -1] == d.OTHER
    assert np.flatnonzero(out[d.DEPARTED])[0] < 512


@pytest.mark.parametrize("late", [-0.7, 0.9])
def test_a_lateness_of_the_recorded_motion_is_none(late: float) -> None:
    out = decided(late, 0.5)

    assert not np.any(out[d.DEPARTED])
    assert np.mean(out[d.FOUND_LATE, -256:]) == pytest.approx(late, abs=0.1)


def test_a_healthy_rig_is_not_alarmed_by_its_shape() -> None:
    assert not np.any(decided(0.0, 1.5)[d.DEPARTED])


def test_friction_beside_late_inputs_is_named_though_it_changes_the_motion() -> None:
    out = decided(0.9, 0.5, friction=1.0)

    assert out[d.VERDICT, -1] == d.FRICTION
    assert 2048 <= np.flatnonzero(out[d.DEPARTED])[0] < 2056
