"""Drawn rigs: each flavour runs, moves as its kind does, and repeats to the byte."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from sim_plant.family import FLAVOURS, Member, Scenario, draw, explain, members, play, watch
from sim_plant.family.drives import Drive, voltage
from sim_plant.family.folder import write_rig
from sim_plant.family.kernel import ISENTROPIC, flow, hidden_effects, simulate
from sim_plant.family.laws import Flow
from sim_plant.family.scenarios import SINE8, tuned_force

pytestmark = pytest.mark.long

RATE = 256
Floats = NDArray[np.float64]


# Members, and the scenarios of one, take seconds to draw: what is the same code for all flavours
# is tested by day on one of each group.
FEW_BY_DAY = pytest.mark.parametrize(
    "member",
    [
        pytest.param(name, marks=() if name in {"orifice", "spool"} else pytest.mark.nightly)
        for name in sorted(FLAVOURS)
    ],
    indirect=True,
    scope="module",
)

drawn = cache(draw)
recordings = cache(watch)


@pytest.fixture(scope="module", params=sorted(FLAVOURS))
def member(request: pytest.FixtureRequest) -> Member:
    return drawn(request.param, 1)


def healthy(drive: Drive = SINE8, seconds: float = 6.0) -> Scenario:
    return Scenario("healthy", drive, seconds)


def rubbing(onset: float, newtons: float) -> Scenario:
    return Scenario("dry friction", SINE8, 6.0, onset, {"dry": newtons})


def rms(values: Floats) -> float:
    return float(np.std(values))


@pytest.mark.nightly
def test_closed_chambers_swing_as_those_of_the_thesis(member: Member):
    assert 5.0 < member.air_spring_hz < 12.0


def test_starts_at_rest_and_moves_as_much_as_its_kind(member: Member):
    time, voltage, x, a = play(member, "healthy", healthy()).T
    assert time[1] == 1 / RATE
    assert abs(x[0]) < 1e-3
    assert abs(a[0]) < 1.0
    assert np.abs(voltage).max() <= 1.4
    assert 3e-3 < np.ptp(x[-RATE:]) / 2 < 10e-3
    assert 8.0 < np.ptp(a[-RATE:]) / 2 < 26.0


def test_noise_of_the_accelerometer_at_rest(member: Member):
    a = play(member, "silent", healthy(Drive("sine", 0.0, 8.0), 2.0))[:, 3]
    assert 0.01 < rms(a) < 0.15


def test_friction_changes_the_motion_from_its_onset_only(member: Member):
    onset = 3.0
    clean = play(member, "same", healthy())
    faulty = play(member, "same", rubbing(onset, 0.7))
    first = round(onset * RATE)
    assert np.array_equal(clean[:first], faulty[:first])
    change = faulty[first:, 3] - clean[first:, 3]
    assert rms(change[: RATE // 8]) > 0.5
    assert np.ptp(faulty[-RATE:, 2]) < 0.97 * np.ptp(clean[-RATE:, 2])


def test_friction_takes_the_power_that_its_force_says(member: Member):
    """Less motion the more it rubs, whatever its law."""
    ranges = [np.ptp(play(member, "x", rubbing(0.5, f))[-RATE:, 2]) for f in (0.2, 0.5, 0.9)]
    assert ranges[0] > ranges[1] > ranges[2]


def test_half_the_step_gives_the_same_motion(member: Member):
    volts = voltage(SINE8, replace(member, ramp_s=0.0), 2.0)
    held = np.repeat(volts[:, :1], volts.shape[1], axis=1)
    coarse, fine = (_run(member, np.repeat(held, n, axis=0), n) for n in (1, 2))
    change = coarse[:, 1:] - fine[::2, 1:]
    # A law that switches does so a step sooner or later, which shows in single samples only.
    assert (np.std(change, axis=0) < 3e-3 * np.std(coarse[:, 1:], axis=0)).all()


def _run(member: Member, volts: Floats, times: int) -> Floats:
    out, no_noise = np.empty((len(volts), 3)), np.zeros((len(volts), 2))
    record = member.record.copy()
    record["lvdt_step"] = 1e-9
    hidden = hidden_effects({"dry": 0.7})
    on_time = np.zeros(2, dtype=np.int64)
    rate = float(RATE * times)
    simulate(
        volts,
        0.0,
        no_noise,
        on_time,
        hidden,
        len(volts) // 2,
        record,
        member.rest.copy(),
        rate,
        out,
    )
    return out


def test_a_free_generator_is_off_the_clock(member: Member):
    drive = Drive("sine", 1.0, 8.0, free=True)
    turns = voltage(drive, replace(member, ramp_s=0.0), 20.0)[:, 0]
    crossings = np.flatnonzero((turns[:-1] < 0) & (turns[1:] >= 0))
    part = crossings + turns[crossings] / (turns[crossings] - turns[crossings + 1])
    hz = (len(part) - 1) / (part[-1] - part[0]) * RATE
    mean = member.clock + 10.0 * member.clock_drift
    assert hz == pytest.approx(8.0 * (1 + mean), rel=3e-4)
    assert 1e-3 < abs(member.clock) <= 0.02


def test_voltage_is_held_or_smooth(member: Member):
    inside = np.ptp(voltage(SINE8, member, 2.0), axis=1).max()
    assert (inside > 0) == member.flavour.smooth_generator


@FEW_BY_DAY
def test_same_seed_same_samples_and_another_seed_another_rig(member: Member):
    flavour = member.name.rpartition("_")[0]
    again, other = draw(flavour, 1), draw(flavour, 2)
    one, two, three = (play(m, "a", healthy(seconds=1.0)) for m in (member, again, other))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, three)
    assert again.record == member.record


@FEW_BY_DAY
def test_recordings_have_the_names_and_onsets_of_the_other_rig(member: Member):
    watched, explained = recordings(member), explain(member)
    for name in ("chirp", "multisine", "start_stop_change", "experiment_7", "fault_spring"):
        assert name in watched
    assert watched["experiment_2"].from_s == 3.05
    assert watched["friction_sine8_free"].drive.free
    assert {"healthy", "none", "two", "pressure", "accel_late"} <= explained.keys()
    most = 0.4 * tuned_force(member)
    for name, scenario in watched.items():
        if scenario.what == "dry friction":
            assert 0.5 <= scenario.hidden["dry"] <= 0.9, name
            assert scenario.hidden["dry"] < most, name


@pytest.mark.parametrize("name", ["hard_noise", "hard_loop", "hard_frequency", "hard_late_start"])
def test_hard_recordings_are_healthy_until_friction_begins(name: str):
    member = drawn("orifice", 1)
    of = recordings(member)
    clean, faulty = (
        play(member, "n", of[name]),
        play(member, "n", of[f"{name}_friction"]),
    )
    first = round(18.0 * RATE)
    assert of[name].what.startswith("healthy")
    assert np.array_equal(clean[:first], faulty[:first])
    assert not np.array_equal(clean[first:], faulty[first:])
    assert np.abs(clean[:, 2]).max() < 0.045


def test_a_controller_lets_the_voltage_follow_the_measured_motion():
    member = drawn("iso", 1)
    loop = replace(SINE8, loop=True)
    one, two = (play(member, noise, healthy(loop, 2.0)) for noise in ("one", "two"))
    assert np.ptp(one[:, 1] - play(member, "one", healthy(seconds=2.0))[:, 1]) > 0.01
    assert not np.array_equal(one[:, 1], two[:, 1])


def test_the_groups_share_no_pair_of_flow_and_friction_laws():
    kinds = {
        group: {(k.flow, k.stage, k.added) for k in FLAVOURS.values() if k.group == group}
        for group in ("calibration", "judged")
    }
    assert (len(kinds["calibration"]), len(kinds["judged"])) == (4, 5)
    assert not kinds["calibration"] & kinds["judged"]
    with pytest.raises(ValueError, match="calibration or judged"):
        members("other")


@pytest.mark.parametrize("law", list(Flow))
def test_flow_laws_are_odd_rise_with_the_drop_and_are_straight_near_zero(law: Flow):
    def w(a: float, b: float) -> float:
        return float(flow(int(law), a, b, 1e-4, 0.3, 0.01))

    drops = np.linspace(1.0, 60e3, 200)
    flows = np.array([w(300e3, 300e3 - drop) for drop in drops])
    assert (np.diff(flows) > -1e-9).all()
    assert w(280e3, 300e3) == -w(300e3, 280e3)
    assert w(3e5, 3e5 - 20) == pytest.approx(2 * w(3e5, 3e5 - 10), rel=0.01)


def test_isentropic_flow_chokes_where_its_formula_says():
    def w(down: float) -> float:
        return float(flow(ISENTROPIC, 1e5, down, 1.0, 0.3, 0.01))

    assert w(0.5e5) == w(0.1e5) == pytest.approx(1e5, rel=1e-3)
    assert w(0.6e5) < w(0.5e5)


def test_a_folder_has_the_layout_of_the_other_rig(tmp_path, monkeypatch):
    member = drawn("spool", 1)
    few = {"healthy_sine8": healthy(seconds=1.0), "friction_sine8": rubbing(0.5, 0.6)}
    monkeypatch.setattr("sim_plant.family.folder.PARTS", {"watch": lambda _: few})
    write_rig(tmp_path, member, ("watch",))
    truth = json.loads((tmp_path / "truth.json").read_text())["watch"]
    assert truth["healthy_sine8"] == {"what": "healthy"}
    assert truth["friction_sine8"]["from_s"] == 0.5
    first, second = (tmp_path / "watch/healthy_sine8.csv").read_text().splitlines()[:2]
    assert first == "time_s,voltage_V,position_m,acceleration_m_s2"
    assert len(second.split(",")) == 4
