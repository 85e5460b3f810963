"""Commissioning: a model file from recordings."""

from monitor.commissioning.commission import CommissionSettings, commission
from monitor.commissioning.equations import stated_in_si, units_of_parameters
from monitor.commissioning.scheme_choice import channels_of, commission_best

__all__ = [
    "CommissionSettings",
    "channels_of",
    "commission",
    "commission_best",
    "stated_in_si",
    "units_of_parameters",
]
