"""The effects hidden in each machine, and the library names that count as right."""

from sim_plant.specimens import converters, electric, flow_and_seal, heat_and_flow, mass
from sim_plant.specimens.specimen import Machine, Specimen

_MASS = Machine("mass-spring-damper", 128.0, mass.drive, mass.march)
_BLOCK = Machine("heated-block", 1.0, heat_and_flow.heat, heat_and_flow.warm)
_VESSEL = Machine("vessel", 50.0, heat_and_flow.gas, heat_and_flow.fill)
_BEARING = Machine("bearing", 50.0, heat_and_flow.turn, heat_and_flow.rub)
_WINDING = Machine("winding", 256.0, electric.volts, electric.conduct)
_TANKS = Machine("tanks", 1.0, flow_and_seal.pumped, flow_and_seal.drain)
_SEAL = Machine("pneumatic-seal", 50.0, flow_and_seal.stroked, flow_and_seal.pull)
_ARMATURE = Machine("motor", 256.0, electric.armature, electric.spin)
_MOTOR = Machine("two-mass-drive", 256.0, electric.amps, electric.turn_load)
_COIL = Machine("voice-coil", 2048.0, electric.amplified, electric.shake)

KNOWN = dict.fromkeys(("coulomb_by_direction", "position_dependent"), ("coulomb@load",))
"""Effects that the model has already where the hidden one says how they differ from place to place
or one way from the other.
"""

HIDDEN: dict[str, Specimen] = {
    name: Specimen(machine, name, named, KNOWN.get(name, ()))
    for machine, effects in (
        (_MASS, {
            **{n: (f"{n}@load",) for n in mass.CONTACTS},
            **{n: (f"{n}@drive",) for n in converters.DRIVES},
            **{n: (f"{n}@acceleration_sensor",) for n in converters.OF_ACCELERATION},
            **{n: (f"{n}@position_sensor",) for n in converters.OF_POSITION},
        }),
        (_BLOCK, {n: (f"{n}@loss",) for n in heat_and_flow.LOSSES if n != "convection"}),
        (_VESSEL, {n: (f"{n}@outlet",) for n in heat_and_flow.OUTLETS}),
        (_BEARING, {
            "viscous_by_temperature": ("viscous_by_temperature@race",),
            "coulomb_by_temperature": ("coulomb_by_temperature@race",),
            "zero_by_temperature": ("zero_by_temperature@torque_sensor",),
            "gain_by_temperature": ("gain_by_temperature@torque_sensor",),
            "cross_axis": ("cross_axis@torque_sensor",),
            "load_dependent": ("load_dependent@race",),
        }),
        (_WINDING, {
            "back_emf": ("back_emf@drive",),
            "supply_sag": ("supply_sag@drive",),
            "current_limit": ("current_limit@drive",),
            "brush_drop": ("brush_drop@contact",),
            "resistance_by_temperature": ("resistance_by_temperature@contact",),
            "saturating_inductance": ("saturating_inductance@iron",),
        }),
        (_TANKS, {"leakage": ("leakage@upper",)}),
        (_SEAL, {n: (f"{n}@seal",) for n in ("viscous", "linear_stiffness")}),
        (_ARMATURE, {"series_resistance": ("series_resistance@drive",)}),
        (_MOTOR, {n: (f"{n}@drive",) for n in electric.PUSHES}),
        (_COIL, {n: (f"{n}@magnet",) for n in electric.FACTORS}),
        (_COIL, {"eddy_currents": ("eddy_currents@coil",)}),
    )
    for name, named in effects.items()
}  # fmt: skip
"""By the effect's name."""


def specimen(effect: str) -> Specimen:
    """The machine that hides this effect."""
    return HIDDEN[effect]
