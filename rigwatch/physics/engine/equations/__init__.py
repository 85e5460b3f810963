"""Models and effects as equations with units.

    model.toml + effects at ports ──compose──▶ System: states, parameters, derivatives, outputs

`expression` parses, `dimension` checks units, `scope` holds the names that an equation may use,
`effect_files` reads effects, and `composite` puts one behind another.
"""

from rigwatch.physics.engine.equations.composite import Composite, EffectMap
from rigwatch.physics.engine.equations.effect import Effect, EffectParameter, EffectState
from rigwatch.physics.engine.equations.effect_files import (
    EffectFile,
    library,
    load_effects,
    offered,
    parse_effects,
)
from rigwatch.physics.engine.equations.expression import FUNCTIONS, names_in, parse, renamed
from rigwatch.physics.engine.equations.measured_motion import (
    along_measured_motion,
    balanced_states,
    has_hidden_states,
    measured_states,
    predicted_outputs,
    sensor_states,
    unjudged_along_motion,
    unmoved_at_rest,
)
from rigwatch.physics.engine.equations.model import (
    Hold,
    Input,
    Model,
    Output,
    Parameter,
    Port,
    Quantity,
    State,
    Variable,
    Variant,
    load_model,
    model_named,
    model_text,
    parse_model,
    shipped_models,
)
from rigwatch.physics.engine.equations.model_check import check_model, check_variants, unused_ports
from rigwatch.physics.engine.equations.quantities import (
    arriving,
    delay_at,
    hold_at,
    names_reached,
    spelt_out,
)
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
    beyond_port,
    compose,
    elements_at,
    signal_order,
    units_at,
)
from rigwatch.physics.engine.equations.variants import neighbours, with_variants

__all__ = [
    "FUNCTIONS",
    "LEFT",
    "PROBE",
    "RATE",
    "STEP",
    "TIME",
    "UNTIL",
    "Composite",
    "Effect",
    "EffectFile",
    "EffectMap",
    "EffectParameter",
    "EffectState",
    "Hold",
    "Input",
    "Model",
    "Output",
    "Parameter",
    "Placement",
    "Port",
    "Quantity",
    "State",
    "System",
    "Variable",
    "Variant",
    "along_measured_motion",
    "arriving",
    "balanced_states",
    "beyond_port",
    "check_model",
    "check_variants",
    "compose",
    "delay_at",
    "elements_at",
    "has_hidden_states",
    "hold_at",
    "library",
    "load_effects",
    "load_model",
    "measured_states",
    "model_named",
    "model_text",
    "names_in",
    "names_reached",
    "neighbours",
    "offered",
    "parse",
    "parse_effects",
    "parse_model",
    "predicted_outputs",
    "renamed",
    "sensor_states",
    "shipped_models",
    "signal_order",
    "spelt_out",
    "symbol",
    "units_at",
    "unjudged_along_motion",
    "unmoved_at_rest",
    "unused_ports",
    "with_variants",
]
