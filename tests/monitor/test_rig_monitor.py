"""Which alarms a rig's monitor raises, with and without the friction scheme."""

import numpy as np

from monitor.alarms import AlarmManager, Occasion
from monitor.decision.sample_kernel import watch_block
from monitor.pipeline.rig_monitor import RigMonitor, compile_kernels
from rigwatch.wire.messages.message_types import Alarm, Column, SampleBlock
from rigwatch.wire.messages.protobuf import decode, encode
from tests.alarms.alarm_signals import newest
from tests.monitor.monitor_rig import SINE, block, friction, model, run


def raised(watching: RigMonitor) -> set[str]:
    """Names of the alarms over a run with friction and three missing readings."""
    channels = run(SINE, 8.0, friction(5.0))
    channels["acceleration"][1000:1003] = np.nan
    watched = watching.update(block(channels))
    assert watched is not None
    return {said.name for said in watched.announcements if isinstance(said, Alarm)}


def test_without_the_friction_scheme_its_alarms_stay_away_and_others_do_not() -> None:
    with_it = raised(RigMonitor(model()))
    without = raised(RigMonitor(model(), friction=False))
    assert {"departure", "dry_friction"} <= with_it
    assert "sensor_invalid" in without
    assert with_it - without >= {"departure", "dry_friction"}
    assert without <= {"gap", "sensor_invalid"}


def test_friction_that_has_gone_clears_on_a_line_that_loses_a_sample_every_second() -> None:
    watching, states = RigMonitor(model()), []
    channels = run(SINE, 14.0, (*friction(8.0), *friction(9.0, 0.0)))
    for first in range(0, 14 * 256, 256):
        lost = 1 if first >= 6 * 256 else 0
        watched = watching.update(block(channels, first + lost, first + 256))
        assert watched is not None
        said = (one for one in watched.announcements if isinstance(one, Alarm))
        states += [alarm.state for alarm in said if alarm.name == "dry_friction"]
    assert states == ["unacknowledged", "cleared_unacknowledged"]


def test_alarms_of_a_detector_that_is_gone_clear_after_a_restart_and_others_do_not() -> None:
    old, new = AlarmManager(), RigMonitor(model())
    for name in ("parity_arma", "dry_friction", "link"):
        old.report(name, Occasion("rig", 1, 9, 9), active=True)
    new.alarms.restore(newest(old.take_changes()))
    watched = new.update(block(run(SINE, 1.0), 0, 64))
    assert watched is not None
    states = [(a.name, a.state) for a in watched.announcements if isinstance(a, Alarm)]
    assert ("parity_arma", "cleared_unacknowledged") in states
    assert new.alarms.holds("dry_friction")
    assert new.alarms.holds("link")


def test_estimates_are_made_with_and_without_the_friction_scheme() -> None:
    samples = block(run(SINE, 6.0))
    both = [RigMonitor(model(), friction=wanted).update(samples) for wanted in (True, False)]
    first, second = (np.array([c.values for c in w.estimates.columns]) for w in both if w)
    np.testing.assert_array_equal(first, second)


def test_compiling_takes_what_is_configured() -> None:
    class Counting:
        """A detector that counts its blocks."""

        name = "counting"
        blocks = 0

        def update(self, _block: object) -> tuple[tuple[()], tuple[()]]:
            self.blocks += 1
            return (), ()

    counting = Counting()
    compile_kernels(model(), [counting])
    assert counting.blocks == 1


def test_a_sample_from_the_bus_finds_its_kernel_compiled() -> None:
    """A kernel that compiles anew for it would hold the first estimate up for many seconds."""
    compile_kernels(model())
    known = len(watch_block.signatures)
    watching, seq = RigMonitor(model()), 0
    for n in (1, 3, 1):
        times, zeros = np.arange(seq, seq + n, dtype=np.int64), np.zeros(n)
        channels = tuple(Column(c, "", zeros, np.zeros(n, np.uint8)) for c in model().channels)
        samples = SampleBlock("rig", 1, seq, times, times, channels)
        watching.update(decode(SampleBlock, encode(samples)))
        seq += n
    assert len(watch_block.signatures) == known
