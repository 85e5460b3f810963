"""What the motion alone says of a sensor is not fitted with the plant."""

import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.equations import Model, along_measured_motion, check_model
from rigwatch.physics.engine.equations.model import shipped_models
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
