"""An alarm tells its figure, and again while it stands if it becomes better, ever more rarely."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.alarms import AlarmManager
from monitor.signals.conditions import Condition
from rigwatch.wire.messages import Alarm, transitions
from tests.alarms.alarm_signals import newest, order, run, spell

BEGIN, REST, LENGTH = 10, 600, 4000


def friction(value: np.ndarray, *, words: str = "{:.3g} N of friction") -> Condition:
    """Dry friction of a force at each sample [N], from `BEGIN` to `REST` samples before the end."""
    n = value.size
    limit = np.zeros(n)
    active = spell(n, (BEGIN, n - REST))
    return Condition("dry_friction", active, value, limit - np.inf, limit, words)


def told(said: list) -> list[tuple[int, str, float]]:
    return [(one.seq, one.state, one.value) for one in said if isinstance(one, Alarm)]


def test_a_force_that_settles_is_told_once_more() -> None:
    force = np.full(LENGTH, 0.5)
    force[:40] = 0.3

    first, again, over = told(run(AlarmManager(), [friction(force)]))

    assert first[1:] == ("unacknowledged", 0.3)
    # A quarter of a second after the alarm.
    assert again == (first[0] + 64, "unacknowledged", 0.5)
    assert over[1] == "cleared_unacknowledged"


def test_the_force_stands_in_the_cause_and_what_was_told_last_remains() -> None:
    force = np.full(LENGTH, 0.5)
    force[:40] = 0.3

    said = run(AlarmManager(), [friction(force)])

    first, again, over = [one.cause.rsplit(": ")[-1] for one in said if isinstance(one, Alarm)]
    assert first == "0.3 N of friction"
    assert again == over == "0.5 N of friction"


@pytest.mark.parametrize("force", [0.0, np.nan])
def test_a_force_that_is_not_known_yet_is_not_told(force: float) -> None:
    first, *_ = run(AlarmManager(), [friction(np.full(LENGTH, force))])

    assert isinstance(first, Alarm)
    assert "friction:" not in first.cause.removeprefix("dry friction:")
    assert first.cause.endswith("dirt")


def test_a_force_that_grows_is_told_as_the_alarm_grows_twice_as_old() -> None:
    found = told(run(AlarmManager(), [friction(np.arange(LENGTH, dtype=float))]))

    first, *again, _ = found
    assert [seq - first[0] for seq, _, _ in again] == [64, 128, 256, 512, 1024, 2048]
    assert all(value == seq for seq, _, value in again)


@pytest.mark.parametrize(
    ("change", "words"), [(0.04, "{:g} N"), (0.3, "")], ids=["small", "not of this condition"]
)
def test_other_changes_are_not_told(change: float, words: str) -> None:
    force = np.full(LENGTH, 0.5 * (1.0 + change))
    force[:40] = 0.5

    assert len(told(run(AlarmManager(), [friction(force, words=words)]))) == 2


def test_nobody_is_told_again_who_has_acknowledged() -> None:
    alarms = AlarmManager()
    run(alarms, [friction(np.full(LENGTH, 0.5))._replace(active=spell(LENGTH, (BEGIN, LENGTH)))])
    alarms.command(order("dry_friction", "acknowledge"))

    later = friction(np.full(LENGTH, 0.9))._replace(active=np.ones(LENGTH, np.uint8))
    assert told(run(alarms, [later])) == []


def test_a_restarted_monitor_tells_it_too() -> None:
    old = AlarmManager()
    run(old, [friction(np.full(200, 0.5))._replace(active=np.ones(200, np.uint8))])
    new = AlarmManager()
    new.restore(newest(old.take_changes()))

    later = friction(np.full(400, 0.9))._replace(active=np.ones(400, np.uint8))
    ((seq, state, value),) = told(run(new, [later]))

    assert (seq, state, value) == (65, "unacknowledged", 0.9)


@settings(max_examples=50, deadline=None)
@given(cuts=st.lists(st.integers(1, 1399), max_size=20), seed=st.integers(0, 100))
def test_what_is_told_does_not_depend_on_the_cut(cuts: list[int], seed: int) -> None:
    condition = friction(np.random.default_rng(seed).uniform(0.4, 0.6, 1400).round(2))

    assert repr(run(AlarmManager(), [condition], cuts)) == repr(run(AlarmManager(), [condition]))


def test_an_alarm_told_again_has_been_raised_once() -> None:
    said = run(AlarmManager(), [friction(np.arange(LENGTH, dtype=float))])
    alarms = [one for one in said if isinstance(one, Alarm)]

    raised, over = transitions(alarms)

    assert (raised.state, raised.seq, raised.value) == (
        "unacknowledged", alarms[0].seq, alarms[-2].value,
    )  # fmt: skip
    assert over == alarms[-1]


def test_an_alarm_that_comes_again_has_been_raised_twice() -> None:
    said = run(AlarmManager(), [friction(np.full(1000, 0.5))])
    again = run(AlarmManager(), [friction(np.full(1000, 0.5))])

    assert len(transitions([one for one in (*said, *again) if isinstance(one, Alarm)])) == 4
