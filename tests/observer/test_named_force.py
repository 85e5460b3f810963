"""The force with which dry friction is named is that of the friction, not of a part before it."""

import pytest

from rigwatch.wire.messages import Alarm
from sim_plant.excitation import Sine
from sim_plant.scenario import Event
from tests.monitor.observed_rig import FREE, SINE, run, watched


@pytest.mark.parametrize("drive", [SINE, FREE], ids=["locked", "free"])
@pytest.mark.parametrize("force", [0.12, 0.3, 0.6])
def test_friction_is_named_with_its_force(drive: Sine, force: float) -> None:
    named = told(drive, 6.0, Event(at_s=5.0, effect="coulomb", value=force))
    assert named[0] == pytest.approx(force, rel=0.15)


def test_the_force_of_friction_that_grows_is_told_again() -> None:
    named = told(SINE, 8.0, Event(at_s=5.0, effect="coulomb", value=0.6, over_s=1.0))
    assert named[0] < 0.3
    assert named[-1] == pytest.approx(0.6, rel=0.15)
    assert len(named) <= 5


def told(drive: Sine, seconds: float, event: Event) -> list[float]:
    """The forces that an alarm of dry friction tells [N]."""
    return [
        one.value
        for one in watched(run(drive, seconds, (event,), seed=43)).announcements
        if isinstance(one, Alarm) and one.name == "dry_friction" and one.state == "unacknowledged"
    ]
