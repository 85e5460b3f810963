"""The force with which dry friction is named is that of the friction, not of a part before it."""

import pytest

from rigwatch.wire.messages import Alarm
from sim_plant.excitation import Sine
from sim_plant.scenario import Event
from tests.monitor.observed_rig import FREE, SINE, run, watched


@pytest.mark.parametrize("drive", [SINE, FREE], ids=["locked", "free"])
@pytest.mark.parametrize("force", [0.12, 0.3, 0.6])
def test_friction_is_named_with_its_force(drive: Sine, force: float) -> None:
    found = watched(run(drive, 6.0, (Event(at_s=5.0, effect="coulomb", value=force),), seed=43))
    named = [
        one.value
        for one in found.announcements
        if isinstance(one, Alarm) and one.name == "dry_friction" and one.state == "unacknowledged"
    ]
    assert named[0] == pytest.approx(force, rel=0.15)
