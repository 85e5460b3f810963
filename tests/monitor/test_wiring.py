"""The wiring check at the start: what is wired wrongly is told with its reason, and not judged."""

from collections.abc import Callable

import numpy as np
import pytest
from msgspec import structs

from monitor.model.model_file import RigModel, model_text, parse_model
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.wiring.motion_ratio import motion_ratio
from monitor.wiring.wiring_check import WiringCheck
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages.message_types import Alarm, EstimateBlock
from rigwatch.wire.rig_config import AlarmSection
from sim_plant.excitation import Chirp, Multisine, Shape, Sine, Square
from tests.monitor import monitor_rig, observed_rig
from tests.monitor.monitor_rig import RATE, SINE, block, fault, friction, run

Channels = dict[str, np.ndarray]
JUDGED = {"departure", "dry_friction", "stiction", "other_fault"}
# Volts, metres and m/s^2 of one code: a channel in another's place shows its codes.
VOLT, METRE, ACCELERATION = 3.05e-4, 7.75e-7, 1.496e-2
COARSE, ROUGH = 2.5e-5, 0.02
"""Resolution of a position [m] and noise of an acceleration [m/s^2]."""
SECOND = np.arange(round(RATE)) / RATE
SCHEMES = {"transfer": monitor_rig.model, "equations": observed_rig.model}


def watched(
    channels: Channels, model: RigModel, lengths: int = 0, **settings: AlarmSection
) -> tuple[dict[str, float], list[EstimateBlock]]:
    """Time of each alarm [s] and the estimates, of a recording cut into blocks."""
    monitor, times, estimates = RigMonitor(model, settings), dict[str, float](), []
    count = len(channels["voltage"])
    for first in range(0, count, lengths or count):
        found = monitor.update(block(channels, first, min(first + (lengths or count), count)))
        assert found is not None
        estimates.append(found.estimates)
        for said in found.announcements:
            if isinstance(said, Alarm):
                times.setdefault(said.name, said.seq / RATE)
    return times, estimates


def swapped_drive(c: Channels) -> None:
    c["voltage"], c["position"] = c["position"] * VOLT / METRE, c["voltage"] * METRE / VOLT


def swapped_sensors(c: Channels) -> None:
    c["position"], c["acceleration"] = (
        c["acceleration"] * METRE / ACCELERATION,
        c["position"] * ACCELERATION / METRE,
    )


def reversed_position(c: Channels) -> None:
    c["position"] = -c["position"]


def in_g(c: Channels) -> None:
    c["acceleration"] = c["acceleration"] / 9.80665


def in_millimetres(c: Channels) -> None:
    c["position"] = 1000.0 * c["position"]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    ("tamper", "alarm"),
    [
        (swapped_drive, "wiring_swapped"),
        (swapped_sensors, "wiring_scale"),
        (reversed_position, "wiring_sign"),
        (in_g, "wiring_scale"),
        (in_millimetres, "wiring_scale"),
    ],
)
def test_wrong_wiring_is_reported_and_nothing_is_judged(
    scheme: str, tamper: Callable[[Channels], None], alarm: str
) -> None:
    channels = run(SINE, 12.0, friction(8.0))
    tamper(channels)
    times, estimates = watched(channels, SCHEMES[scheme]())
    assert times[alarm] <= 2.0
    assert not JUDGED & times.keys()
    assert not any(block.column("armed").values.any() for block in estimates)


@pytest.mark.parametrize("factor", [1000.0, 10.0, 0.1, -1.0])
def test_a_drive_in_the_wrong_unit_or_reversed_is_reported_and_nothing_is_learnt(
    factor: float,
) -> None:
    channels = run(SINE, 12.0, friction(8.0))
    channels["voltage"] = factor * channels["voltage"]
    times, estimates = watched(channels, monitor_rig.model())
    assert times["wiring_drive"] <= 2.0
    assert not {*JUDGED, "reference_learnt"} & times.keys()
    assert not any(block.column("armed").values.any() for block in estimates)


@pytest.mark.parametrize("begin", range(0, 64, 8))
def test_the_moment_at_which_a_monitor_starts_does_not_hide_a_wrong_drive(begin: int) -> None:
    channels = run(SINE, 5.0)
    channels["voltage"] = 0.1 * channels["voltage"]
    later = {name: values[begin:] for name, values in channels.items()}
    times, _ = watched(later, monitor_rig.model())
    assert times["wiring_drive"] <= 2.0


def test_a_rig_that_is_moved_by_hand_is_not_blamed_for_its_drive() -> None:
    channels = run(SINE, 8.0)
    channels["voltage"] = 1e-4 * channels["voltage"]
    times, _ = watched(channels, monitor_rig.model())
    assert not {name for name in times if name.startswith("wiring")}


@pytest.mark.parametrize("level", [0.4, 1.5])
def test_friction_from_the_start_is_no_wiring(level: float) -> None:
    times, _ = watched(run(SINE, 6.0, friction(0.0, level)), monitor_rig.model())
    assert not {name for name in times if name.startswith("wiring")}


@pytest.mark.parametrize(
    "drive",
    [SINE, Sine(amplitude=1.0, frequency=1.5), Square(amplitude=1.4, frequency=8.0),
     Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=14.0),
     Multisine(amplitude=2.5, start=0.5, stop=12.0, period=1024, seed=1)],
    ids=lambda drive: type(drive).__name__,
)  # fmt: skip
def test_right_wiring_passes_under_any_drive(drive: Shape) -> None:
    times, _ = watched(run(drive, 8.0), monitor_rig.model())
    assert not {name for name in times if name.startswith("wiring")}


@pytest.mark.parametrize("effect", ["acceleration_gain", "acceleration_lag"])
def test_a_sensor_that_fails_later_is_a_fault_and_no_wiring(effect: str) -> None:
    values = {"acceleration_gain": 4.0, "acceleration_lag": 0.05}
    times, _ = watched(run(SINE, 10.0, fault(effect, values[effect], 6.0)), monitor_rig.model())
    assert not {name for name in times if name.startswith("wiring")}
    assert JUDGED & times.keys()


def test_a_wiring_alarm_clears_once_the_wiring_is_right_after_a_restart_of_the_device() -> None:
    wrong, right, monitor = run(SINE, 4.0), run(SINE, 4.0), RigMonitor(monitor_rig.model())
    reversed_position(wrong)
    said = []
    for boot, channels in ((1, wrong), (2, right)):
        found = monitor.update(block(channels, boot=boot))
        assert found is not None
        said += [one for one in found.announcements if isinstance(one, Alarm)]
    states = [(one.boot, one.state) for one in said if one.name == "wiring_sign"]
    assert states == [(1, "unacknowledged"), (2, "cleared_unacknowledged")]


def ten_volts(c: Channels) -> None:
    c["voltage"] = 10.0 * c["voltage"]


@pytest.mark.parametrize("tamper", [in_g, ten_volts])
def test_the_cut_into_blocks_changes_no_alarm_and_no_estimate(
    tamper: Callable[[Channels], None],
) -> None:
    channels = run(SINE, 6.0)
    tamper(channels)
    channels["position"][300] = np.nan
    whole = watched(channels, monitor_rig.model())
    for length in (1, 37):
        times, estimates = watched(channels, monitor_rig.model(), length)
        assert times == whole[0]
        for name in ("armed", "residual"):
            cut = np.concatenate([block.column(name).values for block in estimates])
            np.testing.assert_array_equal(cut, whole[1][0].column(name).values)


def test_a_person_may_say_that_the_wiring_is_as_it_is_to_be() -> None:
    channels = run(SINE, 10.0)
    in_g(channels)
    off = {name: AlarmSection(enabled=False) for name in
           ("wiring_sign", "wiring_scale", "wiring_swapped")}  # fmt: skip
    times, estimates = watched(channels, monitor_rig.model(), **off)
    assert not {name for name in times if name.startswith("wiring")}
    assert estimates[0].column("armed").values[-1] == 1.0


@pytest.mark.parametrize("steps", [1, 3, 8])
def test_a_position_that_steps_while_it_settles_is_no_motion(steps: int) -> None:
    settling = COARSE * np.round(steps * (1.0 - np.exp(-4.0 * SECOND)))
    noise = ROUGH * np.random.default_rng(1).standard_normal(SECOND.size)

    assert motion_ratio(settling, noise, RATE) is None


def test_coarse_channels_in_motion_show_it() -> None:
    turns = 2.0 * np.pi * 8.0
    position = COARSE * np.round(5e-3 * np.sin(turns * SECOND) / COARSE)
    acceleration = ROUGH * np.round(-5e-3 * turns**2 * np.sin(turns * SECOND) / ROUGH)

    found = motion_ratio(position, acceleration, RATE)

    assert found is not None
    assert found.gain == pytest.approx(1.0, abs=0.05)
    assert found.phase == pytest.approx(0.0, abs=1.0)


def accepting(model: RigModel, *names: str) -> RigModel:
    return structs.replace(model, accepted_wiring=names)


def four_times(c: Channels) -> None:
    c["acceleration"] = 4.0 * c["acceleration"]


def test_what_a_person_has_accepted_passes_and_nothing_else_does() -> None:
    channels = run(SINE, 8.0)
    four_times(channels)
    times, estimates = watched(channels, accepting(monitor_rig.model(), "wiring_scale"))
    assert not {name for name in times if name.startswith("wiring")}
    assert estimates[0].column("armed").values.any()
    times, _ = watched(channels, accepting(monitor_rig.model(), "wiring_sign", "wiring_swapped"))
    assert times["wiring_scale"] <= 2.0
    channels["voltage"] = -channels["voltage"]
    times, estimates = watched(channels, accepting(monitor_rig.model(), "wiring_scale"))
    assert times["wiring_drive"] <= 2.0
    assert not any(block.column("armed").values.any() for block in estimates)


@pytest.mark.parametrize("reversed_too", [False, True])
def test_a_running_monitor_takes_the_word_from_the_next_sample_on(*, reversed_too: bool) -> None:
    channels, model = run(SINE, 12.0), monitor_rig.model()
    four_times(channels)
    if reversed_too:
        channels["voltage"] = -channels["voltage"]
    monitor, at = RigMonitor(model), round(4.0 * RATE)
    before = monitor.update(block(channels, 0, at))
    assert before is not None
    assert monitor.alarms.holds("wiring_scale")
    monitor.adopt(accepting(model, "wiring_scale"))
    first = monitor.update(block(channels, at, at + round(RATE) - 1))
    after = monitor.update(block(channels, at + round(RATE) - 1, len(channels["voltage"])))
    assert first is not None
    assert after is not None
    assert not before.estimates.column("armed").values.any()
    assert not first.estimates.column("armed").values.any(), "in doubt until a window has passed"
    assert not monitor.alarms.holds("wiring_scale")
    assert monitor.alarms.holds("wiring_drive") == reversed_too
    assert after.estimates.column("armed").values.any() != reversed_too


def test_the_models_word_is_kept_in_its_file() -> None:
    model = accepting(monitor_rig.model(), "wiring_swapped", "wiring_drive")
    assert parse_model(model_text(model), "again") == model
    assert "accepted_wiring" not in model_text(monitor_rig.model())
    broken = model_text(model).replace("wiring_swapped", "wiring_any")
    with pytest.raises(ConfigError, match="accepted_wiring"):
        parse_model(broken, "broken")


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rig_of_a_sample_in_two_seconds_is_not_checked(scheme: str) -> None:
    slow = structs.replace(SCHEMES[scheme](), sample_rate=0.5)
    found = WiringCheck(slow).update(block(run(SINE, 1.0), 0, 16))
    assert not found[1]
