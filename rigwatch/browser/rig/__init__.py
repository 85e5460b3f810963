"""The rig's page: live signals and alarms, and a study made from an alarm."""

from rigwatch.browser.rig.alarm_study import study_of_alarm
from rigwatch.browser.rig.link import RigLink

__all__ = ["RigLink", "study_of_alarm"]
