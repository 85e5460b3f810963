"""The observer scheme: fitted equations run along the measured motion, for any excitation.

    samples ─▶ motion ─▶ prediction ─▶ residual ─▶ decision ─▶ estimates, conditions
               (lag)     (equations)   (remainder,  (range, window,
                                        high-pass)   episode, verdict)

A model of equations is driven by the measured motion, so its hidden states need no initial values
and its residual is the missing force at every sample. It needs no period, no phase and no recording
of a known fault. Its part of the model file is declared in `monitor.model`, and
`monitor.commissioning` creates it from healthy recordings.
"""

from monitor.observer.channel_jumps import ChannelJumps, bends_of
from monitor.observer.decision import decide, decision_state, friction_limit
from monitor.observer.decision.decision_state import (
    DEVIATIONS,
    EVIDENCE,
    LASTING,
    MEDIUM,
    OUTPUTS,
    SHORT,
    SPREAD,
    DecisionRules,
    new_state,
)
from monitor.observer.lagged_motion import EMPTY, FIRST, MATCHED, motion_kernel
from monitor.observer.missing_force import (
    DISAGREE,
    DRY_UNIT,
    MEASURED,
    PREDICTED,
    WEAK,
    WEAKER,
    E,
    high_pass,
    levels,
    terms,
)
from monitor.observer.model_signals import (
    LaggedSignals,
    Layout,
    Observed,
    ObserverSignals,
    layout_of,
)
from monitor.observer.prediction import (
    SETTLING,
    SUBSTEPS,
    balanced,
    base_model,
    driven,
    equations_of,
    force_port,
    friction_at,
    rate_columns,
)
from monitor.observer.range_seen import RangeSeen, drive_energy, range_of, range_signals
from monitor.observer.remainder import fit_remainder, no_remainder
from monitor.observer.remainder_terms import RemainderTerms, information_matrix
from monitor.observer.spectral_width import SpectralWidth, Spectrum
from monitor.observer.usual_error import Extremes, UsualError, steady_motion

__all__ = [
    "DEVIATIONS",
    "DISAGREE",
    "DRY_UNIT",
    "EMPTY",
    "EVIDENCE",
    "FIRST",
    "LASTING",
    "MATCHED",
    "MEASURED",
    "MEDIUM",
    "OUTPUTS",
    "PREDICTED",
    "SETTLING",
    "SHORT",
    "SPREAD",
    "SUBSTEPS",
    "WEAK",
    "WEAKER",
    "ChannelJumps",
    "DecisionRules",
    "E",
    "Extremes",
    "LaggedSignals",
    "Layout",
    "Observed",
    "ObserverSignals",
    "RangeSeen",
    "RemainderTerms",
    "SpectralWidth",
    "Spectrum",
    "UsualError",
    "balanced",
    "base_model",
    "bends_of",
    "decide",
    "decision_state",
    "drive_energy",
    "driven",
    "equations_of",
    "fit_remainder",
    "force_port",
    "friction_at",
    "friction_limit",
    "high_pass",
    "information_matrix",
    "layout_of",
    "levels",
    "motion_kernel",
    "new_state",
    "no_remainder",
    "range_of",
    "range_signals",
    "rate_columns",
    "steady_motion",
    "terms",
]
