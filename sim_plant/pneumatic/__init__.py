"""The equations of the simulated rig: its motion, and the air that moves it."""

from sim_plant.pneumatic.air_kernel import balance
from sim_plant.pneumatic.plant_kernel import DELAY_LINE, STATE_TYPE, TRUTH, advance_plant

__all__ = ["DELAY_LINE", "STATE_TYPE", "TRUTH", "advance_plant", "balance"]
