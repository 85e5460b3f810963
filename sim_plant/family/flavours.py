"""The flavours of the family: sets of laws that fix the equations of a member.

Thresholds are chosen on the flavours of `calibration` and judged on those of `judged`. No judged
flavour has the same flow, friction, valve and heat laws as a calibration flavour.
"""

from dataclasses import dataclass

from sim_plant.family.laws import Flow, Friction, Heat, Stage


@dataclass(frozen=True, slots=True)
class Flavour:
    """The laws of a member and its construction details.

    Args:
        group: calibration or judged.
        flow, heat, stage: laws of the gas and of the valve.
        own: dry friction of the healthy rig, None for none.
        added: law of the dry friction that is added as a fault.
        second_order_valve: else one lag.
        play, slew, asymmetry: whether the valve has a small one.
        high_passes: stages of the accelerometer's AC coupling, 1 or 2.
        smooth_generator: the voltage moves between samples; else it is held over each.
        smoothed: the DAQ smooths the acceleration by a first-order digital filter.
        late: a channel is sampled a part of a sample late.
        fine_position: 16 bit over the LVDT's range; else steps of 0.001 in.
        drifting: the free generator's rate changes as it runs.
        mistuned: the free generator is up to 2 % off; else a few tenths of a percent.
        abrupt: the excitation begins at full amplitude.
        late_fault: how `accel_late` is late: lag, delay or smoothing.
        stranger: what `pressure` is: ripple of the supply, a lower middle pressure or a blockage.
        regulated: a lost supply lowers the middle pressure but not the valve's gain.
        softer: the hidden spring pushes away from mid stroke.
    """

    group: str
    flow: Flow
    heat: Heat
    stage: Stage
    own: Friction | None
    added: Friction
    second_order_valve: bool = True
    play: bool = False
    slew: bool = False
    asymmetry: bool = False
    high_passes: int = 1
    smooth_generator: bool = False
    smoothed: bool = False
    late: bool = False
    fine_position: bool = False
    drifting: bool = False
    mistuned: bool = False
    abrupt: bool = False
    late_fault: str = "lag"
    stranger: str = "ripple"
    regulated: bool = False
    softer: bool = False


FLAVOURS: dict[str, Flavour] = {
    "iso": Flavour(
        "calibration", Flow.ISO_6358, Heat.ISOTHERMAL, Stage.PRESSURE,
        own=Friction.LUGRE, added=Friction.LUGRE, late_fault="lag", stranger="middle",
        regulated=True, softer=True,
    ),
    "orifice": Flavour(
        "calibration", Flow.ORIFICE, Heat.POLYTROPIC, Stage.PRESSURE,
        own=None, added=Friction.TANH, second_order_valve=False, play=True, high_passes=2,
        smooth_generator=True, fine_position=True, drifting=True, late_fault="delay",
    ),
    "blend": Flavour(
        "calibration", Flow.BLEND, Heat.ENERGY, Stage.PRESSURE,
        own=Friction.TANH, added=Friction.STRIBECK, asymmetry=True, smoothed=True, mistuned=True,
        late_fault="smoothing", stranger="blockage",
    ),
    "nozzles": Flavour(
        "calibration", Flow.ORIFICE, Heat.ISOTHERMAL, Stage.BRIDGE,
        own=None, added=Friction.KARNOPP, second_order_valve=False, late=True, abrupt=True,
        stranger="ripple",
    ),
    "weymouth": Flavour(
        "judged", Flow.WEYMOUTH, Heat.POLYTROPIC, Stage.PRESSURE,
        own=None, added=Friction.DAHL, second_order_valve=False, slew=True, fine_position=True,
        late_fault="smoothing", stranger="middle", softer=True,
    ),
    "isentropic": Flavour(
        "judged", Flow.ISENTROPIC, Heat.ENERGY, Stage.PRESSURE,
        own=Friction.LUGRE, added=Friction.LUGRE, asymmetry=True, high_passes=2, late=True,
        drifting=True, late_fault="lag", stranger="ripple", regulated=True,
    ),
    "capillary": Flavour(
        "judged", Flow.CAPILLARY, Heat.ISOTHERMAL, Stage.PRESSURE,
        own=Friction.DAHL, added=Friction.KARNOPP, play=True, smooth_generator=True,
        smoothed=True, mistuned=True, late_fault="delay", stranger="ripple",
    ),
    "spool": Flavour(
        "judged", Flow.ISO_6358, Heat.ENERGY, Stage.BRIDGE,
        own=None, added=Friction.STRIBECK, abrupt=True, fine_position=True,
        late_fault="lag", stranger="blockage", softer=True,
    ),
    "regulated": Flavour(
        "judged", Flow.ISENTROPIC, Heat.POLYTROPIC, Stage.REGULATED,
        own=Friction.LUGRE, added=Friction.STRIBECK, high_passes=2, fine_position=True,
        late_fault="delay", stranger="middle", regulated=True,
    ),
}  # fmt: skip
