"""Linear models of the rig: transfer functions, their frequency responses and their fits.

The thesis's friction-free model is `fit_transfer_function` over a measured frequency response
(5.19); its friction filter is the output-error model (5.29). `period` finds the period of an
excitation.
"""

from rigwatch.physics.transfer.derivative import Derivative
from rigwatch.physics.transfer.frequency_fit import fit_transfer_function
from rigwatch.physics.transfer.frequency_response import FrequencyResponse, frequency_response
from rigwatch.physics.transfer.lateness import SensorPhase, lateness, sensor_phase
from rigwatch.physics.transfer.output_error import (
    OutputErrorFit,
    OutputErrorOrders,
    fit_output_error,
)
from rigwatch.physics.transfer.period import period_by_correlation, shortest_period
from rigwatch.physics.transfer.transfer_function import Filter, TransferFunction, filter_sample
from rigwatch.physics.transfer.velocity import velocity_filter

__all__ = [
    "Derivative",
    "Filter",
    "FrequencyResponse",
    "OutputErrorFit",
    "OutputErrorOrders",
    "SensorPhase",
    "TransferFunction",
    "filter_sample",
    "fit_output_error",
    "fit_transfer_function",
    "frequency_response",
    "lateness",
    "period_by_correlation",
    "sensor_phase",
    "shortest_period",
    "velocity_filter",
]
