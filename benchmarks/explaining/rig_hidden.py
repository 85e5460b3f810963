"""Recordings of the simulated rig with hidden effects of given strengths.

The strength is measured by the change of the outputs: by a share of their rms in the channel where
it shows most, measured on sensors without noise or steps.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from rigwatch.physics.engine.fit.recording import Recording
from sim_plant.excitation import Multisine, drive
from sim_plant.parameters import RigParameters
from sim_plant.rig import Rig

RIG = RigParameters()
CLEAN = replace(
    RIG, lvdt_noise=0.0, lvdt_resolution=0.0, accelerometer_noise=0.0, voltage_noise=0.0
)
"""The same rig with sensors without noise and quantization."""
SAMPLES, WARM = 5120, 1024
"""Number of recorded samples and of samples before; 20 s and 4 s."""
PERIOD = 1024


@dataclass(frozen=True)
class Hidden:
    """An effect of the simulated rig.

    Attributes:
        name: in `sim_plant.effects`.
        right: library names; several if no recording can distinguish them.
        base: value at strength 0.
        way: value at a strength s > 0: base + s, base - s, or base/(1 + s).
    """

    name: str
    right: tuple[str, ...] = ()
    base: float = 0.0
    way: str = "more"

    def value(self, strength: float) -> float:
        """The value of the plant's effect."""
        if self.way == "limit":
            return self.base / (1.0 + strength)
        return self.base + (strength if self.way == "more" else -strength)


_LATE = "lag@{0}", "delay@{0}"
_A, _X = "acceleration_sensor", "position_sensor"
_GAINS = (f"gain@{_X}", f"gain@{_A}")
_LISTED = (
    Hidden("viscous", ("viscous@load",)),
    Hidden("coulomb", ("coulomb@load",)),
    Hidden("stribeck", ("stribeck@load",)),
    Hidden("quadratic_drag", ("quadratic_drag@load",)),
    Hidden("spring", ("linear_stiffness@load",)),
    Hidden("cubic_spring", ("cubic_stiffness@load",)),
    Hidden("constant_force", ("constant_force@load", "offset@drive")),
    Hidden("actuator_gain", ("gain@drive",), 1.0, "less"),
    Hidden("actuator_deadband", ("dead_band@drive",)),
    Hidden("actuator_saturation", ("saturation@drive",), 2.6, "limit"),
    Hidden("actuator_rate_limit", ("rate_limit@drive",), 120.0, "limit"),
    Hidden("actuator_lag", tuple(name.format("drive") for name in _LATE)),
    Hidden("actuator_delay", tuple(name.format("drive") for name in _LATE)),
    Hidden("chamber_leak", ("leakage@between", "orifice@between")),
    Hidden("leak_1", ("leakage@first", "orifice@first")),
    Hidden("leak_2", ("leakage@second", "orifice@second")),
    Hidden("position_gain", _GAINS, 1.0, "less"),
    Hidden("position_bias", (f"offset@{_X}",)),
    Hidden("position_drift", (f"drift@{_X}",)),
    Hidden("position_lag", tuple(name.format(_X) for name in _LATE)),
    Hidden("position_saturation", (f"saturation@{_X}",), 0.025, "limit"),
    Hidden("acceleration_gain", _GAINS, 1.0, "less"),
    Hidden("acceleration_bias", (f"offset@{_A}",)),
    Hidden("acceleration_lag", tuple(name.format(_A) for name in _LATE)),
    Hidden("acceleration_delay", tuple(name.format(_A) for name in _LATE)),
    Hidden("acceleration_saturation", (f"saturation@{_A}",), 25.0, "limit"),
)
_SWALLOWED = (Hidden("actuator_offset", ("offset@drive", "constant_force@load")),)
_OUTSIDE = (
    Hidden("port_blockage"),
    Hidden("added_mass"),
    Hidden("backlash"),
    Hidden("supply_drop"),
    Hidden("periodic_force"),
)
EVERY: dict[str, Hidden] = {h.name: h for h in (*_LISTED, *_SWALLOWED, *_OUTSIDE)}
RIGHT: dict[str, tuple[str, ...]] = {h.name: h.right for h in _LISTED}
"""Library names of each hidden effect.

A gain of one motion sensor is a gain of the other and of the valve together; a constant force is
balanced by pressure, as an offset of the valve is.
"""
BLACK_BOX: dict[str, tuple[str, ...]] = {
    "leak_1": ("leakage@between", "orifice@between"),
    "leak_2": ("leakage@between", "orifice@between"),
}
"""Differences for the black box, which has no chambers."""
ABSORBED = tuple(h.name for h in _SWALLOWED)
"""Effects that parameters of the model are: the zero of its valve is fitted to each recording."""
UNKNOWN = tuple(h.name for h in _OUTSIDE)
"""In no library: blocked lines, inertia, play in the rod's joint, a lost supply, shaking."""


def recorded(
    effects: Mapping[str, float], excitation: int, noise: int, rig: RigParameters = RIG
) -> Recording:
    """Voltage, position and acceleration as the sensors give them.

    Args:
        effects: of the plant, by name.
        excitation: seed of the multisine's phases; lines from 0.5 to 12 Hz, 2.5 V at most.
        noise: seed of the sensors.
        rig: parameters of the rig.
    """
    plant = Rig(rig, noise)
    for name, value in effects.items():
        plant.set_effect(name, value)
    shape = Multisine(amplitude=2.5, start=0.5, stop=12.0, period=PERIOD, seed=excitation)
    source = drive(shape, rig.sample_rate)
    plant.advance(source(np.arange(WARM)))
    codes = plant.advance(source(np.arange(WARM, WARM + SAMPLES))).codes
    si = codes * rig.si_per_code
    return Recording(1 / rig.sample_rate, si[:, :1].copy(), si[:, 1:].copy())


@cache
def healthy_outputs(excitation: int) -> NDArray[np.float64]:
    """Outputs of the rig with clean sensors and nothing hidden, shape (n, 2)."""
    return recorded({}, excitation, 0, CLEAN).outputs


def caused(effects: Mapping[str, float], excitation: int) -> NDArray[np.float64]:
    """Rms change of the two outputs by effects, in their units."""
    moved = recorded(effects, excitation, 0, CLEAN).outputs - healthy_outputs(excitation)
    return np.asarray(np.sqrt(np.mean(moved**2, axis=0)))


@cache
def settings(name: str, share: float, excitation: int) -> float:
    """The value of the effect at which it changes an output by `share` of its rms."""
    hidden, healthy = EVERY[name], healthy_outputs(excitation)
    size = np.sqrt(np.mean(healthy**2, axis=0))

    def reaches(strength: float) -> bool:
        return bool(np.max(caused({name: hidden.value(strength)}, excitation) / size) >= share)

    low, high = 1e-6, 1e-6
    while not reaches(high) and high < 1e9:
        low, high = high, high * 4
    for _ in range(12):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return hidden.value(float(np.sqrt(low * high)))
