"""The same samples give the same alarms however they are cut into blocks."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.alarms import AlarmManager
from rigwatch.wire.rig_config import AlarmSection
from tests.alarms.alarm_signals import condition, run

NAMES = ("departure", "dry_friction", "gap", "not_observable", "sensor_stuck.position", "link")
SAMPLES = 240
FLAGS = st.lists(st.integers(0, SAMPLES), max_size=12)


def _flags(cuts: list[int]) -> np.ndarray:
    """Flags that change at each of the cuts."""
    flags = np.zeros(SAMPLES, np.uint8)
    for cut in cuts:
        flags[cut:] ^= 1
    return flags


def _manager() -> AlarmManager:
    return AlarmManager({name: AlarmSection(persistence=3, clear_after=7) for name in NAMES})


@settings(max_examples=150, deadline=None)
@given(
    changes=st.lists(FLAGS, min_size=len(NAMES), max_size=len(NAMES)),
    cuts=st.lists(st.integers(1, SAMPLES - 1), max_size=30),
)
def test_alarms_and_records_do_not_depend_on_the_cut(changes, cuts):
    conditions = [condition(name, _flags(one)) for name, one in zip(NAMES, changes, strict=True)]
    whole, pieces = _manager(), _manager()
    assert repr(run(whole, conditions)) == repr(run(pieces, conditions, cuts))
    assert repr(whole.take_changes()) == repr(pieces.take_changes())
    assert repr(whole.standing()) == repr(pieces.standing())


@settings(max_examples=100, deadline=None)
@given(changes=FLAGS, persistence=st.integers(1, 20), clear_after=st.integers(1, 20))
def test_edges_agree_with_a_sample_by_sample_reading_of_the_rule(changes, persistence, clear_after):
    flags = _flags(changes)
    section = AlarmSection(persistence=persistence, clear_after=clear_after, latch=False)
    # Comings of a departure are not joined to a series, however often it comes.
    said = run(AlarmManager({"departure": section}), [condition("departure", flags)])
    level, expected = False, []
    for i in range(SAMPLES):
        if not level and i + 1 >= persistence and flags[i + 1 - persistence : i + 1].all():
            level = True
            expected.append(("unacknowledged", i))
        elif level and i + 1 >= clear_after and not flags[i + 1 - clear_after : i + 1].any():
            level = False
            expected.append(("cleared_unacknowledged", i))
    assert [(one.state, one.seq) for one in said] == expected
