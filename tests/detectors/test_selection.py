"""Detectors that a configuration switches on, with a commissioned model."""

import numpy as np
import pytest
from msgspec import structs

from monitor.commissioning.commission import commission
from monitor.detectors import DETECTORS
from monitor.detectors.selection import detectors_of, healthy_signals
from monitor.model.model_file import InertiaPlant, RigModel
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.signals.recordings import recording_of
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages.message_types import Alarm
from sim_plant.scenario import load_scenario
from tests.detectors.simulated_rig import CHANNELS, FOLDER, RATE, SimulatedRig, block, recorded

EVERY = ("friction", *(kind.name for kind in DETECTORS))
NAMES = (CHANNELS.input, CHANNELS.output, CHANNELS.acceleration)


@pytest.fixture(scope="module")
def model() -> RigModel:
    made = []
    for role, name, seconds in (
        ("chirp", "commissioning_chirp", 96.0),
        ("healthy", "healthy_sine_8hz_1v4", 30.0),
        ("friction", "known_friction", 20.0),
    ):
        signals = recorded(load_scenario(FOLDER / f"{name}.toml"), seconds, seed=1)
        columns = dict(zip(NAMES, signals.T, strict=True))
        made.append(recording_of(role, name, RATE, columns))
    return commission(made)


def alarms(model: RigModel, signals: np.ndarray) -> list[tuple[str, int]]:
    """Alarms raised, with their first samples; blocks of one second."""
    watching = RigMonitor(model, detectors=detectors_of(EVERY, model, "rig.toml"))
    raised = []
    for first in range(0, len(signals), 256):
        watched = watching.update(block(signals[first : first + 256], first))
        assert watched is not None
        raised += [
            (said.name, said.onset_seq)
            for said in watched.announcements
            if isinstance(said, Alarm) and said.state == "unacknowledged"
        ]
    return raised


def test_only_what_is_named_is_made(model):
    assert detectors_of(("friction",), model, "rig.toml") == ()
    made = detectors_of(("parity-ma", "unknown-input-kalman"), model, "rig.toml")
    assert [type(one).__name__ for one in made] == ["ParityDetector", "UnknownInputDetector"]


def test_the_same_model_gives_the_same_detectors(model):
    first, second = healthy_signals(model), healthy_signals(model)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_healthy_running_raises_nothing(model, rig: SimulatedRig):
    for seed in (31, 32):
        assert alarms(model, rig.with_fault("coulomb", 0.0, 60.0, seed=seed)) == []


def test_a_moved_sensor_is_seen_by_all_three_and_comes_as_alarms(model, rig: SimulatedRig):
    signals = rig.with_fault("position_bias", 3e-3, 30.0, seed=33)
    onsets = dict(alarms(model, signals))
    at = len(signals) // 2
    for kind in DETECTORS:
        assert 0 <= onsets[kind.condition] - at <= 2


def test_their_columns_are_published_beside_the_estimates(model, rig: SimulatedRig):
    watching = RigMonitor(model, detectors=detectors_of(EVERY, model, "rig.toml"))
    watched = watching.update(block(rig.reference[:500]))
    assert watched is not None
    names = [column.name for column in watched.estimates.columns]
    assert len(names) == len(set(names))
    assert {"parity_arma_residual", "parity_ma_limit", "unknown_input_bias"} <= set(names)
    assert all(len(column.values) == len(watched.estimates) for column in watched.estimates.columns)


def test_a_model_without_transfer_function_is_refused_in_one_line(model):
    inertia = structs.replace(model, plant=InertiaPlant(mass=1.0))
    with pytest.raises(ConfigError, match=r"rig\.toml: monitor\.detectors: .*transfer function"):
        detectors_of(EVERY, inertia, "rig.toml")
