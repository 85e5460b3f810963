"""The rig's page: live signals and alarms, promotions of its model, a study made from an alarm."""

from rigwatch.browser.rig.alarm_study import TooSoonError, study_of_alarm
from rigwatch.browser.rig.faults import Faults
from rigwatch.browser.rig.link import RigLink
from rigwatch.browser.rig.promotions import can_roll_back, promotions, roll_back, study_in_force

__all__ = [
    "Faults",
    "RigLink",
    "TooSoonError",
    "can_roll_back",
    "promotions",
    "roll_back",
    "study_in_force",
    "study_of_alarm",
]
