"""Models and effects as equations with units.

    model.toml + effects at ports ──compose──▶ System: states, parameters, derivatives, outputs

`expression` parses, `dimension` checks units, `scope` holds the names that an equation may use,
`plugins` finds the effects that other packages offer.
"""

from rigwatch.physics.engine.equations.effect import Effect, EffectParameter, library, load_effects
from rigwatch.physics.engine.equations.expression import FUNCTIONS, parse
from rigwatch.physics.engine.equations.measured_motion import (
    along_measured_motion,
    balanced_states,
    has_hidden_states,
    measured_states,
    predicted_outputs,
)
from rigwatch.physics.engine.equations.model import (
    Hold,
    Input,
    Model,
    Output,
    Parameter,
    Port,
    State,
    Variable,
    load_model,
    shipped_models,
)
from rigwatch.physics.engine.equations.model_check import check_model, unused_ports
from rigwatch.physics.engine.equations.plugins import offered
from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.physics.engine.equations.system import (
    LEFT,
    PROBE,
    RATE,
    STEP,
    TIME,
    UNTIL,
    Placement,
    System,
    compose,
    units_at,
)

__all__ = [
    "FUNCTIONS",
    "LEFT",
    "PROBE",
    "RATE",
    "STEP",
    "TIME",
    "UNTIL",
    "Effect",
    "EffectParameter",
    "Hold",
    "Input",
    "Model",
    "Output",
    "Parameter",
    "Placement",
    "Port",
    "State",
    "System",
    "Variable",
    "along_measured_motion",
    "balanced_states",
    "check_model",
    "compose",
    "has_hidden_states",
    "library",
    "load_effects",
    "load_model",
    "measured_states",
    "offered",
    "parse",
    "predicted_outputs",
    "shipped_models",
    "symbol",
    "units_at",
    "unused_ports",
]
