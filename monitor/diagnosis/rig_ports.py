"""The rig as a model with ports: where effects may act, and how each place affects the change.

A monitor's model has no equations of motion, so its ports are evaluated on measured signals, and
the model's filters carry the effect to the residual:

    force at the mass    -Ge for a transfer function, as Ge counts friction against the motion as
                         positive; 1/M for an inertia
    leak of a chamber    pressure follows m·a and decays through a leak: -Ge after an integrator
    drive                Ĝ, as from voltage to modelled acceleration; 1/M for an inertia
    reading of the drive the same with opposite sign: it changes the modelled acceleration only
    accelerometer        no filter; a fault of it acts on what it would read without the change
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from monitor.model import InertiaPlant, RigModel, TransferPlant
from monitor.signals import (
    ACCELERATION,
    G1,
    G2,
    POSITION,
    VELOCITY,
    VOLTAGE,
    InertiaResidual,
    TransferResidual,
    modelled_acceleration,
)
from rigwatch.physics.engine.equations import Input, Model, Output, Port, Variable
from rigwatch.physics.transfer import velocity_filter
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

MOST = 2.0
"""Rms of an effect relative to that of the signal at its port."""
MOST_FRICTION = 10.0
"""Rms of a force in units of the known friction of commissioning."""
Response = Callable[[FloatArray], FloatArray]
_MOTION = ("position", "velocity", "measured", "expected")
"""Inputs beside the drive: the last two are the acceleration, and that without the change."""


@dataclass(frozen=True, eq=False)
class RigPorts:
    """Ports at which an effect may be missing, over a stretch of samples.

    Attributes:
        model: a model without states: its inputs are measured, each of its ports has an output.
        inputs: of the model, shape (samples, inputs).
        outputs: output of each port, by port.
        responses: from that output to the change of the residual [m/s^2], by port.
        known: the part of the change that is healthy [m/s^2], shape (samples,).
        limits: largest plausible rms of an effect at a port, by port.
    """

    model: Model
    inputs: FloatArray
    outputs: Mapping[str, str]
    responses: Mapping[str, Response]
    known: FloatArray
    limits: Mapping[str, float]


def rig_ports(model: RigModel, signals: FloatArray, change: FloatArray) -> RigPorts:
    """The ports of a rig.

    Args:
        model: the current model.
        signals: its channels, finite, shape (samples, channels).
        change: of the residual [m/s^2], finite, shape (samples,).
    """
    if isinstance(model.plant, InertiaPlant):
        return _inertia(model, model.plant, signals, change)
    if not isinstance(model.plant, TransferPlant):
        raise ModelError("the model is one of equations: rank effects with rigwatch explain")
    return _transfer(model, model.plant, signals, change)


def _transfer(
    model: RigModel, plant: TransferPlant, signals: FloatArray, change: FloatArray
) -> RigPorts:
    columns = TransferResidual(model).update(signals, np.zeros(len(signals), np.int64))
    against = model.friction.function().simulate
    integrator = velocity_filter(
        model.velocity.corner, model.sample_rate, model.velocity.sensor_corner
    ).simulate
    drive = modelled_acceleration(plant, model.sample_rate)[0].simulate
    made = {"load": "load", "chambers": "chambers", "drive": "drive"}
    ports = {
        "load": Port(kind="force", unit="1", variables=_motion("measured")),
        "chambers": Port(kind="force", unit="1", variables={"p": _variable("measured")}),
        "drive": Port(kind="actuator", signal="voltage"),
        **_sensors("voltage", "acceleration"),
    }
    outputs = made | {"voltage_sensor": "voltage_read", "acceleration_sensor": "acceleration_read"}
    return RigPorts(
        _static("voltage", ports, outputs),
        _inputs(columns, change),
        outputs,
        {
            "load": lambda push: -against(push),
            "chambers": lambda push: -against(integrator(push)),
            "drive": drive,
            "voltage_sensor": lambda push: -drive(push),
            "acceleration_sensor": lambda push: push,
        },
        np.zeros(len(signals)),
        {
            "load": MOST_FRICTION,
            "drive": MOST * _rms(columns[:, VOLTAGE]),
            "voltage_sensor": MOST * _rms(columns[:, VOLTAGE]),
            "acceleration_sensor": MOST * _rms(columns[:, ACCELERATION]),
        },
    )


def _inertia(
    model: RigModel, plant: InertiaPlant, signals: FloatArray, change: FloatArray
) -> RigPorts:
    columns = InertiaResidual(model).update(signals, np.zeros(len(signals), np.int64))
    assert model.band is not None
    known = columns[:, [G1, G2]] @ np.mean([model.band.low, model.band.high], axis=0)
    ports = {
        "load": Port(kind="force", unit="1", variables=_motion("force")),
        "drive": Port(kind="actuator", signal="force"),
        **_sensors("force", "acceleration"),
    }
    outputs = {
        "load": "load", "drive": "drive", "force_sensor": "force_read",
        "acceleration_sensor": "acceleration_read",
    }  # fmt: skip
    return RigPorts(
        _static("force", ports, outputs),
        _inputs(columns, change - known),
        outputs,
        {
            "load": lambda push: push / plant.mass,
            "drive": lambda push: push / plant.mass,
            "force_sensor": lambda push: -push / plant.mass,
            "acceleration_sensor": lambda push: push,
        },
        known,
        {
            "load": MOST * _rms(columns[:, VOLTAGE]),
            "drive": MOST * _rms(columns[:, VOLTAGE]),
            "force_sensor": MOST * _rms(columns[:, VOLTAGE]),
            "acceleration_sensor": MOST * _rms(columns[:, ACCELERATION]),
        },
    )


def _inputs(columns: FloatArray, change: FloatArray) -> FloatArray:
    """The drive and `_MOTION`, shape (samples, 5)."""
    measured = columns[:, [VOLTAGE, POSITION, VELOCITY, ACCELERATION]]
    return np.column_stack([measured, columns[:, ACCELERATION] - change])


def _rms(signal: FloatArray) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def _static(drive: str, ports: dict[str, Port], outputs: Mapping[str, str]) -> Model:
    """A model whose outputs are its ports."""
    read = {f"{drive}_read": drive, "acceleration_read": "expected"}
    return Model(
        name="ports of a rig",
        summary="what effects at a rig's ports see and push",
        inputs={name: Input(unit="1") for name in (drive, *_MOTION)},
        parameters={},
        outputs={
            name: Output(unit="1", expression=read.get(name, name)) for name in outputs.values()
        },
        ports=ports,
    )


def _motion(load: str) -> dict[str, Variable]:
    names = {"x": "position", "v": "velocity", "L": load}
    return {name: _variable(signal) for name, signal in names.items()}


def _variable(signal: str) -> Variable:
    return Variable(expression=signal, unit="1")


def _sensors(*channels: str) -> dict[str, Port]:
    return {f"{name}_sensor": Port(kind="sensor", signal=f"{name}_read") for name in channels}
