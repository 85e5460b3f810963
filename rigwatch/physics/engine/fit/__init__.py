"""Fits over short horizons; the initial state of each window is unknown.

Recording ──windows──▶ Problem (initial states projected out) ──▶ fit, evaluate ──▶ Fit
"""

from rigwatch.physics.engine.fit.decimation import Thinning
from rigwatch.physics.engine.fit.effect_states import EffectStates
from rigwatch.physics.engine.fit.initial_state_projection import Tangent
from rigwatch.physics.engine.fit.measured_recording import (
    motion_phases,
    motion_rates,
    motion_recording,
    motion_widths,
)
from rigwatch.physics.engine.fit.opening_values import with_opening_values
from rigwatch.physics.engine.fit.port_signals import port_signals
from rigwatch.physics.engine.fit.problem import ENOUGH, Problem, Started
from rigwatch.physics.engine.fit.recorded_effect_states import RecordedEffectStates
from rigwatch.physics.engine.fit.recording import (
    SAME_SPACING,
    Recording,
    apart,
    beginning,
    ends_of_holes,
    filled,
    initial_states,
    joined,
    of_parts,
    rate_of_change,
    shown_states,
    windows,
    with_effects,
)
from rigwatch.physics.engine.fit.ties import untied
from rigwatch.physics.engine.fit.windowed_fit import (
    CLOSE,
    FAR,
    QUIET,
    Fit,
    Prior,
    bounds,
    covariance_of,
    deviations,
    error_at,
    evaluate,
    fit,
    result_of,
)

__all__ = [
    "CLOSE",
    "ENOUGH",
    "FAR",
    "QUIET",
    "SAME_SPACING",
    "EffectStates",
    "Fit",
    "Prior",
    "Problem",
    "RecordedEffectStates",
    "Recording",
    "Started",
    "Tangent",
    "Thinning",
    "apart",
    "beginning",
    "bounds",
    "covariance_of",
    "deviations",
    "ends_of_holes",
    "error_at",
    "evaluate",
    "filled",
    "fit",
    "initial_states",
    "joined",
    "motion_phases",
    "motion_rates",
    "motion_recording",
    "motion_widths",
    "of_parts",
    "port_signals",
    "rate_of_change",
    "result_of",
    "shown_states",
    "untied",
    "windows",
    "with_effects",
    "with_opening_values",
]
