"""The lateness of the inputs, learnt from the residual."""

import numpy as np
import pytest

from monitor.observer.lateness import TAU, input_lateness, lateness_state, no_lateness
from monitor.observer.lateness.lateness_state import SLOW
from monitor.observer.missing_force import COLUMNS, DRY_UNIT, LATE_UNIT, E
from tests.compiled import from_python
from tests.observer.lateness.followed import AT, DRY, LATE, NOISE, N, follow_lateness, learnt

is_late = from_python(lateness_state.is_late)
lateness_changes = from_python(input_lateness.lateness_changes)
rubs = from_python(input_lateness.rubs)
seems_late = from_python(input_lateness.seems_late)
seems_to_grow = from_python(input_lateness.seems_to_grow)
slides = from_python(input_lateness.slides)
told_lateness = from_python(input_lateness.told_lateness)


@pytest.mark.parametrize("tau", [-0.9, -0.4, 0.3, 1.0])
def test_lateness_is_found(tau) -> None:
    kept = learnt(tau * LATE)

    assert kept[TAU] == pytest.approx(tau, abs=0.05)
    assert is_late(kept)
    assert not lateness_changes(kept)


@pytest.mark.parametrize(("tau", "told"), [(0.0, 0.0), (0.1, 0.0), (0.7, 0.7), (-0.7, -0.7)])
def test_a_lateness_that_matters_is_told(tau, told) -> None:
    assert told_lateness(learnt(tau * LATE)) == pytest.approx(told, abs=0.05)


def test_one_that_slides_is_not() -> None:
    assert told_lateness(learnt(np.linspace(-0.2, 0.9, N) * LATE)) == 0.0


@pytest.mark.parametrize(("since", "grows"), [(512, True), (16, False), (48, False)])
def test_a_lateness_that_grows_slowly_is_told_from_a_sudden_one(since, grows) -> None:
    # A clock that is 0.1 % off moves its edges by half a sample in two seconds.
    tau = np.where(np.arange(N) < N - since, 0.0, np.linspace(-0.5, 0.5, N) if grows else 0.5)
    rows = np.zeros((N, len(COLUMNS)))
    rows[:, E] = tau * LATE + NOISE * np.random.default_rng(8).standard_normal(N)
    rows[:, LATE_UNIT], rows[:, DRY_UNIT] = LATE, DRY
    kept = no_lateness()
    for row in rows:
        follow_lateness(row, NOISE**2, NOISE**2, True, True, False, kept)

    assert slides(kept) == grows
    assert (kept[TAU] > 0.4) == grows


def test_a_lateness_that_shrinks_is_followed() -> None:
    # The edges slide towards the samples: the less is left, the less of it a lateness explains.
    other = 0.4 * np.sin(5.3 * AT + 0.3)

    kept = learnt(np.linspace(-0.8, -0.3, N) * LATE + other)

    assert kept[TAU] == pytest.approx(-0.3, abs=0.06)


def test_a_lateness_that_friction_explains_as_well_seems_to_grow() -> None:
    dry = np.sign(np.sin(AT + 0.2))
    kept = learnt(np.linspace(0.0, 0.6, N) * LATE + 0.2 * dry, dry=dry)

    assert seems_to_grow(kept)
    assert not seems_to_grow(learnt(0.6 * LATE))
    assert not seems_to_grow(learnt(0.6 * dry, dry=dry))
    assert not seems_to_grow(learnt(np.linspace(0.0, 3.0, N) * dry, dry=dry))


def test_friction_is_not_learnt_as_lateness() -> None:
    kept = learnt(0.3 * DRY)

    assert kept[TAU] == 0.0
    assert rubs(kept)


def test_what_friction_explains_nearly_as_well_is_not_learnt_as_lateness() -> None:
    dry = np.tanh(3.0 * np.sin(AT))

    assert learnt(0.1 * LATE + 0.15 * dry, dry=dry)[TAU] == 0.0


def test_nothing_is_learnt_from_a_healthy_residual() -> None:
    assert learnt(0.02 * LATE)[TAU] == 0.0


def test_a_residual_as_large_as_in_commissioning_is_not_explained() -> None:
    rows = np.zeros((N, len(COLUMNS)))
    rows[:, E], rows[:, LATE_UNIT], rows[:, DRY_UNIT] = 0.5 * LATE, LATE, DRY
    kept = no_lateness()
    for row in rows:
        follow_lateness(
            row, 4.0 * float(np.mean(rows[:, E] ** 2)), NOISE**2, False, True, False, kept
        )

    assert kept[TAU] == 0.0
    assert not is_late(kept)


@pytest.mark.parametrize(("anew", "expected"), [(True, -0.6), (False, 0.0)])
def test_what_a_healthy_rig_usually_leaves_is_left_if_the_motion_has_just_become_known(
    anew, expected
) -> None:
    # A rig that its equations describe less well: half of its largest residual is usual.
    healthy = 1.05 * np.sin(5.3 * AT + 0.3)
    kept, largest = no_lateness(), 2.0 * float(np.mean(healthy**2))
    rows = np.zeros((N, len(COLUMNS)))
    rows[:, E], rows[:, LATE_UNIT] = healthy - 0.6 * LATE, LATE
    rows[:, DRY_UNIT] = np.sign(np.cos(AT))
    for row in rows:
        follow_lateness(row, largest, largest, True, True, anew, kept)

    assert kept[TAU] == pytest.approx(expected, abs=0.1)


def test_what_was_seen_before_a_deviation_is_learnt_once_the_motion_is_known() -> None:
    kept, row = no_lateness(), np.zeros(len(COLUMNS))
    for late, dry in zip(LATE, DRY, strict=True):
        row[E], row[LATE_UNIT], row[DRY_UNIT] = -0.5 * late, late, dry
        follow_lateness(row, 1.0, 1.0, True, True, False, kept)
    assert kept[TAU] == 0.0

    row[E] = 10.0
    follow_lateness(row, NOISE**2, NOISE**2, True, False, True, kept)

    assert kept[TAU] == pytest.approx(-0.5, abs=0.01)


def test_a_lateness_that_is_gone_is_forgotten() -> None:
    kept = learnt(-0.5 * LATE)

    assert learnt(np.zeros(N), kept=kept)[TAU] == 0.0


def test_more_than_inputs_can_be_late_is_none() -> None:
    assert learnt(2.0 * LATE)[TAU] == 0.0

    kept = learnt(-0.5 * LATE)
    row = np.zeros(len(COLUMNS))
    for late in LATE[: round(SLOW / 4)]:
        row[E], row[LATE_UNIT] = 3.0 * late, late
        follow_lateness(row, NOISE**2, NOISE**2, False, True, False, kept)

    assert not lateness_changes(kept)


def test_a_lateness_that_jumps_is_said_to_change() -> None:
    kept = learnt(-0.5 * LATE)
    row, changes = np.zeros(len(COLUMNS)), []
    for late, dry in zip(LATE[: round(SLOW)], DRY, strict=False):
        row[E], row[LATE_UNIT], row[DRY_UNIT] = 0.4 * late, late, dry
        follow_lateness(row, NOISE**2, NOISE**2, False, True, False, kept)
        changes.append(lateness_changes(kept))

    assert sum(changes) > SLOW / 2


def test_friction_is_no_lateness_that_changes() -> None:
    kept, row, changes = learnt(-0.5 * LATE), np.zeros(len(COLUMNS)), []
    for late, dry in zip(LATE, DRY, strict=True):
        row[E], row[LATE_UNIT], row[DRY_UNIT] = 0.5 * dry, late, dry
        follow_lateness(row, NOISE**2, NOISE**2, False, True, False, kept)
        changes.append(lateness_changes(kept))

    assert not any(changes[round(SLOW) :])


def test_most_of_a_slipped_clocks_residual_is_a_lateness_and_most_of_frictions_is_not() -> None:
    assert seems_late(learnt(0.5 * LATE))
    assert not seems_late(learnt(0.3 * DRY))
