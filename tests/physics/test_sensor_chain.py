"""What the motion alone says of a sensor is not fitted with the plant."""

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter, lsim

from monitor.commissioning.equations.sensor_chain import (
    CORNER,
    SETTLED,
    fit_sensor,
    sensor_parameters,
)
from monitor.observer import high_pass
from rigwatch.physics.engine.equations import Model, along_measured_motion, check_model
from rigwatch.physics.engine.equations.measured_motion import predicted_outputs
from rigwatch.physics.engine.equations.model import Output, shipped_models
from rigwatch.physics.engine.fit import Recording, motion_phases
from rigwatch.physics.transfer import SensorPhase
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data.motion import with_sensor_chain

DT = 1.0 / 256.0


@pytest.fixture(scope="module")
def servo() -> Model:
    return along_measured_motion(shipped_models()["servo-pneumatic"])


def phase(late_deviation: float, corner_deviation: float) -> SensorPhase:
    return SensorPhase(0.2, late_deviation, 2.2 * DT, corner_deviation, 0.05, DT)


def test_a_known_corner_and_lateness_are_fixed(servo: Model) -> None:
    found = with_sensor_chain(servo, {"position": phase(1e-3, 1e-4)}).parameters

    assert found["wa"].value == pytest.approx(2.2)
    assert found["ta"].value == 0.0
    assert all(found[name].fixed and not found[name].kept for name in ("wa", "ta"))


def test_what_the_motion_leaves_open_is_fitted_as_before(servo: Model) -> None:
    found = with_sensor_chain(servo, {"position": phase(0.1, 5e-3)})

    assert found == servo
    assert with_sensor_chain(servo, {}) == servo


def test_a_corner_beyond_its_bounds_ends_there(servo: Model) -> None:
    unseen = SensorPhase(0.0, 1e-3, -1e-4, 1e-4, 0.05, DT)

    found = with_sensor_chain(servo, {"position": unseen}).parameters["wa"]

    assert found.value == found.low


def test_a_sensor_names_a_parameter_of_the_model() -> None:
    model = shipped_models()["servo-pneumatic"]
    output = model.outputs["acceleration"]
    wrong = replace(model, outputs=model.outputs | {"acceleration": replace(output, corner="w0")})

    with pytest.raises(ModelError, match=r"outputs.acceleration.corner: found 'w0', expected"):
        check_model(wrong)


def test_a_stated_value_of_a_sensor_is_not_fitted_beside_its_others() -> None:
    """A high-pass with a gain: of a stated gain, the corner is the one that leaves least."""
    model, rate, stated = shipped_models()["servo-pneumatic"], 256.0, 0.7
    gain = replace(model.parameters["wa"], unit="1", shown="", value=1.0, low=0.1, high=10.0)
    mean = replace(model.states["mean"], derivative="wa*(ga*acceleration - mean)")
    parameters = model.parameters | {"ga": gain}
    model = replace(model, states=model.states | {"mean": mean}, parameters=parameters)
    assert sensor_parameters(model) == {"wa", "ga"}
    time = np.arange(20.0 * rate) / rate
    motion = np.sin(2 * np.pi * 0.8 * time) + np.sin(2 * np.pi * 2.3 * time)

    def shown(corner: float, gain: float) -> np.ndarray:
        return motion - lsim(([corner * gain], [1.0, corner]), motion, time)[1]

    measured = shown(4.0, 1.0)
    found = fit_sensor(model, [(np.zeros((len(time), 3)), measured, motion)], rate, {"ga": stated})
    assert list(found) == ["wa"]

    def left(corner: float) -> float:
        error = lfilter(*high_pass(CORNER, rate), shown(corner, stated) - measured)
        return float(np.sum(2 * (np.sqrt(1 + error[round(SETTLED * rate) :] ** 2) - 1)))

    best = minimize_scalar(left, bounds=(1.0, 20.0), method="bounded").x
    assert best != pytest.approx(4.0, rel=0.1)
    assert found["wa"] == pytest.approx(best, rel=0.02)


def with_pressure(*, first: bool) -> Model:
    """The rig with a pressure that is read too, listed before the accelerometer or behind it."""
    model = shipped_models()["servo-pneumatic"]
    pressure = {"pressure": Output(unit="Pa", expression="P1")}
    position = {"position": model.outputs["position"]}
    rest = {"acceleration": model.outputs["acceleration"]}
    return replace(model, outputs=position | (pressure | rest if first else rest | pressure))


@pytest.mark.parametrize("first", [False, True])
def test_the_sensor_of_the_same_motion_is_found_wherever_it_is_listed(*, first: bool) -> None:
    model = with_pressure(first=first)
    along = along_measured_motion(model)

    assert predicted_outputs(model) == ("acceleration", "pressure") == tuple(along.outputs)
    found = with_sensor_chain(along, {"position": phase(1e-3, 1e-4)}).parameters
    assert found["wa"].value == pytest.approx(2.2)
    assert found["ta"].fixed


@pytest.mark.parametrize("first", [False, True])
def test_the_lateness_of_a_position_does_not_depend_on_the_order_of_outputs(*, first: bool) -> None:
    model, late = with_pressure(first=first), 0.25 * DT
    t, random = np.arange(8192) * DT, np.random.default_rng(4)
    tones = [(size, 2 * np.pi * hz) for size, hz in ((4e-3, 3.1), (2e-3, 5.7), (1e-3, 9.3))]
    x = sum(size * np.sin(w * (t - late)) for size, w in tones)
    a = -sum(size * w**2 * np.sin(w * t) for size, w in tones)
    a = a + 0.01 * np.std(a) * random.standard_normal(t.size)
    read = {"position": x, "acceleration": a, "pressure": random.standard_normal(t.size)}
    outputs = np.column_stack([read[name] for name in model.outputs])
    recording = Recording(DT, np.zeros((t.size, len(model.inputs))), outputs)

    assert motion_phases(model, recording)["position"].shift == pytest.approx(late, rel=0.1)
