"""Servo-pneumatic rigs that differ in their equations, drawn from seeds.

A flavour fixes the laws of a member: flow, heat, valve, friction, sensors, clock. Thresholds and
calibrations are chosen on members of the group `calibration` and judged on those of `judged`.
Nothing here is shared with the rig of `sim_plant.rig` or with any model that is fitted.

    member = draw("iso", seed=1)
    write_rig(Path("iso_1"), member)
"""

from sim_plant.family.flavours import FLAVOURS, Flavour
from sim_plant.family.folder import members, write_rig
from sim_plant.family.member import Member, draw
from sim_plant.family.recording import play
from sim_plant.family.scenarios import Scenario, explain, watch

__all__ = [
    "FLAVOURS",
    "Flavour",
    "Member",
    "Scenario",
    "draw",
    "explain",
    "members",
    "play",
    "watch",
    "write_rig",
]
