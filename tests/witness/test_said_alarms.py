"""What a killed witness has said while nobody was connected, the next one says: once, or a gap."""

from dataclasses import replace
from pathlib import Path

from rigwatch.wire.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import ALARMS, Alarm, Gap
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.witness.kept_alarm import KeptAlarm
from rigwatch.witness.process import Witness
from rigwatch.witness.said_alarms import SaidAlarms
from tests.waiting import eventually


class Killed:
    """A witness that is killed after a while, and the files that it leaves."""

    def __init__(self, folder: Path, network: MemoryNetwork) -> None:
        self.kept, self._network = KeptAlarm(folder / "alarms.jsonl.stale"), network
        self._path = folder / "alarms.jsonl.stale.said"
        self._bus: Bus | None = None
        self._said: SaidAlarms | None = None

    def begin(self) -> Witness:
        self._bus = self._network.bus("r", "witness")
        self._said = SaidAlarms(self._path, self.kept.read())
        return Witness(WitnessSection(), self._bus, 0.0, kept=self.kept, said=self._said)

    def kill(self) -> None:
        """What a kill leaves: nothing is written, and the kernel frees the lock."""
        assert self._bus is not None
        assert self._said is not None
        assert self._said._alone is not None
        self._bus.close()
        self._said._alone.give_up()


def heard(network: MemoryNetwork, folder: Path, *, unsaid: str = "") -> list[Alarm | Gap]:
    """What a listener hears of an alarm that was raised while it could hear nothing.

    Args:
        unsaid: state that the killed witness has kept, and not said.
    """
    rig = Killed(folder, network)
    listener = network.bus("r", "dashboard").listen(ALARMS, gaps_in_place=True)
    first = rig.begin()
    eventually(lambda: not listener.drain() and "witness" in listener.positions(), "it is followed")
    network.up = False
    first.turn(31.0, 1)
    standing = rig.kept.read()
    assert standing is not None
    if unsaid:
        rig.kept.write(None if unsaid == "normal" else replace(standing, state=unsaid, t_ns=2))  # type: ignore[arg-type]
    rig.kill()
    network.up = True
    second = rig.begin()
    found: list[Alarm | Gap] = []

    def complete() -> bool:
        found.extend(listener.drain())
        run = second._bus._outlet.run  # type: ignore[union-attr]
        return listener.positions()["witness"][0] == run

    eventually(complete, "the listener has come to the second one")
    rig.kill()
    return found


def states(found: list[Alarm | Gap]) -> list[tuple[str, int] | str]:
    return [(one.state, one.t_ns) if isinstance(one, Alarm) else "gap" for one in found]


def test_an_alarm_that_nobody_could_hear_is_heard_once_and_with_its_time(tmp_path: Path) -> None:
    assert states(heard(MemoryNetwork(), tmp_path)) == [("unacknowledged", 1)]


def test_one_that_was_kept_and_not_said_is_heard_too(tmp_path: Path) -> None:
    found = heard(MemoryNetwork(), tmp_path, unsaid="acknowledged")
    assert states(found) == [("unacknowledged", 1), ("acknowledged", 2)]


def test_where_an_alarm_has_ended_and_its_end_may_not_have_been_said_there_is_a_gap(
    tmp_path: Path,
) -> None:
    found = heard(MemoryNetwork(), tmp_path, unsaid="normal")
    assert states(found) == [("unacknowledged", 1), "gap"]


def test_a_second_witness_keeps_nothing_and_leaves_the_files_of_the_first(tmp_path: Path) -> None:
    path = tmp_path / "alarms.jsonl.stale.said"
    first, second = SaidAlarms(path, None), SaidAlarms(path, None)
    assert first.messages is not None
    assert second.messages is None
    first.close()
    third = SaidAlarms(path, None)
    assert third.messages is not None
    third.close()
