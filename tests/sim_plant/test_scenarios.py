"""Scenario files load, run and do what they say."""

from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
from msgspec import structs

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section, load
from sim_plant.excitation import SHAPES
from sim_plant.parameters import RigParameters
from sim_plant.scenario import Event, Experiment, Scenario, ScenarioRun, load_scenario

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = sorted((CONFIGS / "scenarios").glob("*.toml"))

MINIMAL = """
name = "test"
duration_s = 4.0

[excitation]
shape = "sine"
amplitude = 1.4
frequency = 8.0
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    return path


def experiment(number: int) -> Scenario:
    return load_scenario(CONFIGS / "scenarios" / f"experiment_{number}.toml")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_scenario_loads_and_runs(path: Path):
    scenario = load_scenario(path)
    run = ScenarioRun(scenario, seed=1)
    seconds = min(scenario.duration_s, 120.0)
    samples = run.advance(round(seconds * 256))
    assert samples.seq[0] == 0
    assert len(samples) == round(seconds * 256)
    assert samples.device_us[0] == 0
    assert np.abs(samples.truth["x"]).max() < 0.0254
    assert samples.codes[:, 0].std() > 500


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_friction_comes_only_when_it_is_due(path: Path):
    scenario = load_scenario(path)
    samples = ScenarioRun(scenario, seed=1).advance(round(min(scenario.duration_s, 60.0) * 256))
    friction = samples.truth["friction"]
    dry = [event.at_s for event in scenario.events if event.effect == "coulomb"]
    first = round(min(dry, default=60.0) * 256)
    assert np.all(friction[: first + 1] == 0.0)
    assert not dry or np.abs(friction[first + 1 : first + 64]).max() > 0.0


def test_the_seven_experiments_are_the_published_ones():
    published = {1: [1.0], 2: [3.05], 3: [2.9], 4: [3.05], 5: [2.9], 6: [2.8], 7: [2.7, 3.6]}
    for number, times in published.items():
        scenario = experiment(number)
        assert scenario.experiment is not None
        assert list(scenario.experiment.fault_s) == times
        due = sorted({event.at_s for event in scenario.events})
        assert due == times


def stuck(number: int, after: float) -> float:
    truth = ScenarioRun(experiment(number), seed=1).advance(8 * 256).truth
    return float(np.mean(truth["v"][round(after * 256) :] == 0.0))


def test_sticking_has_the_published_character():
    assert stuck(1, 5.0) > 0.02
    assert stuck(2, 3.3) == 0.0
    assert stuck(3, 3.3) < 0.05
    assert all(0.1 < stuck(number, 3.5) < 0.6 for number in (4, 5, 6))
    assert stuck(7, 3.8) > 0.6


def test_gradual_fault_ramps_and_shrinks_the_acceleration():
    truth = ScenarioRun(experiment(1), seed=1).advance(8 * 256).truth
    level = [
        np.abs(truth["friction"][a:b]).max() for a, b in ((256, 512), (768, 1024), (1300, 2048))
    ]
    assert level[0] < level[1] < level[2] <= 0.8 * 1.3 + 1e-9
    assert np.abs(truth["a"][1300:]).max() < 0.6 * np.abs(truth["a"][:256]).max()


def test_run_does_not_depend_on_its_cuts():
    scenario = experiment(7)
    whole = ScenarioRun(scenario, seed=2).advance(1500)
    run = ScenarioRun(scenario, seed=2)
    parts = [run.advance(n) for n in (1, 690, 2, 0, 300, 507)]
    assert np.array_equal(whole.codes, np.concatenate([part.codes for part in parts]))
    assert np.array_equal(whole.seq, np.concatenate([part.seq for part in parts]))


def test_demo_repeats_for_ever():
    run = ScenarioRun(load_scenario(CONFIGS / "scenarios" / "demo.toml"), seed=1)
    assert run.samples is None
    truth = run.advance(256 * 290).truth
    rubbing = np.abs(truth["friction"]).reshape(-1, 256).max(axis=1) > 0
    assert [bool(rubbing[second]) for second in (10, 30, 50, 130, 150, 170, 275)] == [
        False, True, False, False, True, False, True,
    ]  # fmt: skip


def test_healthy_is_the_same_without_faults():
    truth = ScenarioRun(experiment(3).healthy(5.0), seed=1).advance(5 * 256).truth
    assert np.all(truth["friction"] == 0.0)


def test_effect_can_be_changed_while_it_runs():
    run = ScenarioRun(experiment(2), seed=1)
    run.advance(256)
    run.rig.set_effect("coulomb", 0.5)
    assert np.abs(run.advance(128).truth["friction"]).max() == pytest.approx(0.5)


def test_effects_from_the_start_act_through_the_lead_in(tmp_path: Path):
    path = written(tmp_path, "lead_in_s = 5.0\n" + MINIMAL + "[effects]\ncoulomb = 0.3\n")
    truth = ScenarioRun(load_scenario(path), seed=1).advance(256).truth
    assert np.abs(truth["friction"][0]) == pytest.approx(0.3)


def test_recorded_drive_is_found_beside_the_scenario(tmp_path: Path):
    (tmp_path / "volts.csv").write_text("\n".join(["0.5"] * 100))
    text = 'name = "r"\nduration_s = 1.0\n[excitation]\nshape = "recorded"\nfile = "volts.csv"\n'
    run = ScenarioRun(load_scenario(written(tmp_path, text + "ramp_s = 0.0\n")), seed=1)
    voltage = run.advance(256).truth["voltage"]
    assert voltage[:3] == pytest.approx(0.5, abs=1e-3)
    assert np.diff(voltage)[99] == pytest.approx(-0.5, abs=0.01)


@pytest.mark.parametrize(
    ("text", "key", "says"),
    [
        (MINIMAL.replace("amplitude", "amplitud"), "excitation.amplitud", "amplitude"),
        (MINIMAL.replace("sine", "sinus"), "excitation", "sinus"),
        (MINIMAL.replace("4.0", "-4.0"), "duration_s", "-4.0"),
        (MINIMAL + "[effects]\ncoulom = 1.0\n", "effects.coulom", "'coulomb'?"),
        (MINIMAL + "[effects]\ncoulomb = -1.0\n", "effects.coulomb", "from 0"),
        (MINIMAL + "[plant]\nbores = 1.0\n", "plant.bores", "'bore'"),
        (
            MINIMAL + '[[events]]\nat_s = 1.0\neffect = "gain"\nvalue = 1.0\n',
            "events[0]",
            "'gain'",
        ),
        (
            "cycle_s = 2.0\n"
            + MINIMAL
            + '[[events]]\nat_s = 3.0\neffect = "coulomb"\nvalue = 1.0\n',
            "events[0].at_s",
            "cycle_s",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, key: str, says: str):
    with pytest.raises(ConfigError) as error:
        load_scenario(written(tmp_path, text))
    message = str(error.value)
    assert "scenario.toml" in message
    assert key in message or says in message
    assert says in message


@pytest.mark.parametrize("kind", [Scenario, Event, Experiment, RigParameters, *SHAPES])
def test_every_key_is_described(kind: type[Section]):
    for name, hint in get_type_hints(kind, include_extras=True).items():
        described = any(getattr(part, "description", None) for part in hint.__metadata__)
        assert described, name


def test_plant_file_names_every_key_with_its_default():
    loaded = load(CONFIGS / "plants" / "servo_pneumatic.toml", RigParameters)
    for name, value in structs.asdict(RigParameters()).items():
        assert getattr(loaded, name) == pytest.approx(value), name
    text = (CONFIGS / "plants" / "servo_pneumatic.toml").read_text()
    assert all(f"\n{name} = " in text for name in RigParameters.__struct_fields__)
