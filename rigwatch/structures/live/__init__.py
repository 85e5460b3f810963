"""Monitoring of a structure while it is measured."""

from rigwatch.structures.live.live_watch import LiveDamage, LiveSettings
from rigwatch.structures.live.process import watch_rig

__all__ = ["LiveDamage", "LiveSettings", "watch_rig"]
