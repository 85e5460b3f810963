"""Samples before they are judged: admission, residual against the model, conditions."""

from monitor.signals import conditions
from monitor.signals.admission import (
    DEAD,
    GOOD,
    HELD,
    NEW_BOOT,
    RESTART,
    Admission,
    Admitted,
    Codes,
)
from monitor.signals.conditions import (
    DEPARTURE,
    DRY_FRICTION,
    GAP,
    OTHER_FAULT,
    SENSOR_CLIPPED,
    SENSOR_INVALID,
    STICTION,
    Condition,
    above,
    below,
)
from monitor.signals.inertia import InertiaResidual, commission_inertia
from monitor.signals.recordings import Recording, Role, joined
from monitor.signals.residual import (
    ACCELERATION,
    G1,
    G2,
    MODELLED,
    POSITION,
    VELOCITY,
    VOLTAGE,
    TransferResidual,
    modelled_acceleration,
)

__all__ = [
    "ACCELERATION",
    "DEAD",
    "DEPARTURE",
    "DRY_FRICTION",
    "G1",
    "G2",
    "GAP",
    "GOOD",
    "HELD",
    "MODELLED",
    "NEW_BOOT",
    "OTHER_FAULT",
    "POSITION",
    "RESTART",
    "SENSOR_CLIPPED",
    "SENSOR_INVALID",
    "STICTION",
    "VELOCITY",
    "VOLTAGE",
    "Admission",
    "Admitted",
    "Codes",
    "Condition",
    "InertiaResidual",
    "Recording",
    "Role",
    "TransferResidual",
    "above",
    "below",
    "commission_inertia",
    "conditions",
    "joined",
    "modelled_acceleration",
]
