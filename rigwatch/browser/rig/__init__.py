"""The rig beside the studies: its signals and alarms as they come, and an alarm as a study."""

from rigwatch.browser.rig.alarm_study import study_of_alarm
from rigwatch.browser.rig.link import RigLink

__all__ = ["RigLink", "study_of_alarm"]
