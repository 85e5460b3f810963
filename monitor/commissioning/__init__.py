"""A model file from recordings: transfer function, friction filter, signature, thresholds."""

from monitor.commissioning.commission import CommissionSettings, commission

__all__ = ["CommissionSettings", "commission"]
