"""Fits over short horizons, each window with an unknown initial state.

Recording ──windows──▶ Problem (initial states projected out) ──▶ fit, evaluate ──▶ Fit
"""

from rigwatch.physics.engine.fit.convergence import Convergence, convergence
from rigwatch.physics.engine.fit.decimation import Thinning
from rigwatch.physics.engine.fit.effect_states import Memory, Recall, held_at, seen
from rigwatch.physics.engine.fit.fit_from_afar import fit_from_afar
from rigwatch.physics.engine.fit.measured_recording import motion_recording, motion_widths
from rigwatch.physics.engine.fit.motion_fit import fit_along_motion
from rigwatch.physics.engine.fit.problem import Problem
from rigwatch.physics.engine.fit.recording import Recording, filled, initial_states, windows
from rigwatch.physics.engine.fit.windowed_fit import (
    Fit,
    bounds,
    error_at,
    evaluate,
    fit,
    result_of,
)

__all__ = [
    "Convergence",
    "Fit",
    "Memory",
    "Problem",
    "Recall",
    "Recording",
    "Thinning",
    "bounds",
    "convergence",
    "error_at",
    "evaluate",
    "filled",
    "fit",
    "fit_along_motion",
    "fit_from_afar",
    "held_at",
    "initial_states",
    "motion_recording",
    "motion_widths",
    "result_of",
    "seen",
    "windows",
]
