"""Where equations predict the motion, a drive wrong from the start is named; a fault is not."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from monitor.model import RigModel
from monitor.pipeline.rig_monitor import RigMonitor
from rigwatch.wire.messages import Alarm, EstimateBlock
from sim_plant.excitation import Shape, Sine, Triangle
from sim_plant.scenario import Event
from tests.monitor import observed_rig
from tests.monitor.observed_rig import RATE, SINE, block, coulomb, run

Channels = dict[str, np.ndarray]
TOLD = {"departure", "not_judged"}
ACCEPTED = ("wiring_drive",)


def driven(factor: float, drive: Shape = SINE, seconds: float = 9.0, seed: int = 3) -> Channels:
    """A healthy rig whose drive is measured `factor` times as large as it is."""
    channels = run(drive, seconds, seed=seed)
    channels["voltage"] = factor * channels["voltage"]
    return channels


class Watched:
    """What a monitor makes of recordings, one after the other.

    Attributes:
        times: of the first transition of each alarm [s].
        values: of these alarms.
    """

    def __init__(self, model: RigModel | None = None) -> None:
        self.monitor = RigMonitor(model or observed_rig.model())
        self.times: dict[str, float] = {}
        self.values: dict[str, float] = {}
        self.estimates: list[EstimateBlock] = []

    def take(
        self,
        channels: Channels,
        length: int = 512,
        first: int = 0,
        last: int = 1 << 30,
        boot: int = 1,
    ) -> "Watched":
        end = min(last, len(channels["voltage"]))
        for at in range(first, end, length):
            cut = block(channels, at, min(end, at + length))
            found = self.monitor.update(replace(cut, boot=boot))
            assert found is not None
            self.estimates.append(found.estimates)
            for said in found.announcements:
                if isinstance(said, Alarm) and said.state == "unacknowledged":
                    self.times.setdefault(said.name, said.seq / RATE)
                    self.values.setdefault(said.name, said.value)
        return self

    @property
    def wiring(self) -> set[str]:
        return {name for name in self.times if name.startswith("wiring")}

    def armed(self) -> np.ndarray:
        return np.concatenate([one.column("armed").values for one in self.estimates])


@pytest.mark.parametrize("factor", [-1.0, 10.0, 0.1, 1000.0, 0.001])
def test_a_reversed_drive_and_one_in_a_wrong_unit_are_named(factor: float) -> None:
    found = Watched().take(driven(factor))
    assert TOLD & found.times.keys()
    assert found.times["wiring_drive"] <= 6.1, "departed, settled, two windows"
    assert found.values["wiring_drive"] == pytest.approx(1.0 / factor)
    assert not found.armed()[round(found.times["wiring_drive"] * RATE) :].any(), "not judged"


@pytest.mark.parametrize(
    "drive", [SINE, Sine(amplitude=0.9, frequency=7.1), Triangle(amplitude=1.1, frequency=6.3)]
)
def test_a_right_drive_passes(drive: Shape) -> None:
    found = Watched().take(driven(1.0, drive))
    assert not found.wiring
    assert found.armed()[-1]


@pytest.mark.parametrize(
    "events",
    [
        coulomb(0.0),
        coulomb(0.0, 1.5),
        (Event(at_s=0.0, effect="actuator_gain", value=0.6),),
        (Event(at_s=0.0, effect="supply_drop", value=0.5),),
        (Event(at_s=0.0, effect="acceleration_gain", value=2.0),),
        (Event(at_s=0.0, effect="actuator_deadband", value=0.3),),
    ],
    ids=lambda events: f"{events[0].effect}-{events[0].value}",
)
def test_a_fault_from_the_start_is_told_and_no_drive(events: tuple[Event, ...]) -> None:
    found = Watched().take(run(SINE, 9.0, events))
    assert {"departure", "dry_friction"} & found.times.keys()
    assert not found.wiring


def test_a_rig_that_is_stuck_is_no_rig_with_a_weak_drive() -> None:
    channels = driven(1.0)
    still = run(Sine(amplitude=1e-6, frequency=8.0), 9.0, seed=3)
    found = Watched().take(still | {"voltage": channels["voltage"]})
    assert TOLD & found.times.keys()
    assert not found.wiring


def test_a_drive_that_was_right_and_changes_is_a_fault_of_the_rig() -> None:
    channels = driven(1.0, seconds=16.0)
    channels["voltage"][round(4.0 * RATE) :] *= 0.1
    found = Watched().take(channels)
    assert found.times["departure"] >= 4.0
    assert not found.wiring


def test_it_is_put_right_with_the_next_start_of_the_device() -> None:
    found = Watched().take(driven(-1.0)).take(driven(1.0, seconds=4.0), boot=2)
    assert found.wiring == {"wiring_drive"}
    assert not found.monitor.alarms.holds("wiring_drive")
    assert found.armed()[-1]


def test_what_a_person_has_accepted_is_no_alarm_at_the_start_and_ends_one() -> None:
    model = observed_rig.model()
    accepted = structs.replace(model, accepted_wiring=ACCEPTED)
    assert not Watched(accepted).take(driven(-1.0)).wiring
    found = Watched(model).take(driven(-1.0), last=round(8.0 * RATE))
    assert found.monitor.alarms.holds("wiring_drive")
    found.monitor.adopt(accepted)
    found.take(driven(-1.0), first=round(8.0 * RATE))
    assert not found.monitor.alarms.holds("wiring_drive")


@pytest.mark.nightly
def test_trials_end_and_come_again_as_long_as_the_rig_departs() -> None:
    """Friction hides the drive for a minute and a half; then it is gone, and the drive is named."""
    events = (*coulomb(0.0, 1.5), Event(at_s=90.0, effect="coulomb", value=0.0))
    channels = run(SINE, 112.0, events)
    channels["voltage"] = -channels["voltage"]
    found = Watched().take(channels)
    assert 90.0 < found.times["wiring_drive"] < 112.0


@pytest.mark.parametrize("factor", [-1.0, 0.1])
def test_the_cut_into_blocks_and_a_short_gap_change_nothing(factor: float) -> None:
    channels = driven(factor, seconds=7.0)
    channels["position"][700] = np.nan
    whole = Watched().take(channels, len(channels["voltage"]))
    for length in (37, 256):
        found = Watched().take(channels, length)
        assert (found.times, found.values) == (whole.times, whole.values)
        np.testing.assert_array_equal(found.armed(), whole.armed())
