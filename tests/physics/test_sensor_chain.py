"""What the motion alone says of a sensor is not fitted with the plant."""

import numpy as np
import pytest
from msgspec.structs import replace

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
