"""Commissioning: a model file from recordings."""

from monitor.commissioning.commission import CommissionSettings, commission
from monitor.commissioning.scheme_choice import commission_best

__all__ = ["CommissionSettings", "commission", "commission_best"]
