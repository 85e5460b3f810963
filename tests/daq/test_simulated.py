"""A scenario becomes samples and a session file, the same every time."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from rigwatch.simulated import simulate, write_session
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from sim_plant.parameters import RigParameters
from sim_plant.scenario import load_scenario

CONFIGS = Path(__file__).parents[2] / "configs"
SCENARIO = CONFIGS / "scenarios" / "healthy_sine_8hz_1v4.toml"
DEMO = load_rig(CONFIGS / "demo.toml")


def test_calibration_of_the_demo_is_that_of_the_simulated_sensors() -> None:
    gains = [channel.gain for channel in DEMO.channels]
    np.testing.assert_allclose(gains, RigParameters().si_per_code, rtol=1e-12)


def test_a_scenario_alone_is_calibrated_by_its_sensors() -> None:
    own, demo = (
        next(iter(simulate(SCENARIO, channels, seconds=0.5))) for channels in (None, DEMO.channels)
    )
    for name in ("voltage", "position", "acceleration"):
        np.testing.assert_allclose(own.channel(name).values, demo.channel(name).values, rtol=1e-12)


def test_samples_are_in_si_and_like_the_thesis() -> None:
    blocks = list(simulate(SCENARIO, DEMO.channels, seconds=2.0))
    voltage = np.concatenate([block.channel("voltage").values for block in blocks])
    acceleration = np.concatenate([block.channel("acceleration").values for block in blocks])
    assert len(voltage) == 512
    assert 1.3 < np.abs(voltage).max() < 1.5
    assert 10.0 < np.abs(acceleration).max() < 25.0


def test_how_it_is_cut_changes_nothing() -> None:
    whole, pieces = (
        list(simulate(SCENARIO, DEMO.channels, seconds=1.0, block=size)) for size in (256, 7)
    )
    for name in ("voltage", "position", "acceleration"):
        values = [np.concatenate([b.channel(name).values for b in s]) for s in (whole, pieces)]
        np.testing.assert_array_equal(values[0], values[1])


def test_session_file_holds_the_same_samples(tmp_path: Path) -> None:
    count = write_session(tmp_path / "out.mcap", SCENARIO, DEMO, seconds=20.0)
    session = open_session(tmp_path / "out.mcap")
    recorded = list(session.samples())
    assert count == sum(map(len, recorded)) == 5120
    simulated = list(simulate(SCENARIO, DEMO.channels, seconds=20.0, device=DEMO.daq.name))
    position = [
        np.concatenate([b.channel("position").values for b in s]) for s in (recorded, simulated)
    ]
    np.testing.assert_array_equal(position[0], position[1])
    assert "healthy" in session.info.notes


def test_an_endless_scenario_needs_a_length() -> None:
    endless = load_scenario(CONFIGS / "scenarios" / "demo.toml")
    with pytest.raises(ConfigError, match="an end, or the seconds wanted"):
        simulate(endless, DEMO.channels)


def test_other_channels_are_refused() -> None:
    with pytest.raises(ConfigError, match="2 channels, expected the simulated rig's 3"):
        simulate(SCENARIO, DEMO.channels[:2])


def test_demo_configuration_is_toml_with_comments_for_people() -> None:
    text = (CONFIGS / "demo.toml").read_text(encoding="utf-8")
    assert tomllib.loads(text)["plant"]["scenario"] == "configs/scenarios/demo.toml"
    assert text.count("#") > 5
