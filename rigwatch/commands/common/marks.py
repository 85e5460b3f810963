"""The constant figures of a model file for the screen: signature and limits."""

import math
from pathlib import Path


def marks_of(path: Path | str) -> dict[str, float]:
    """Figures by name, in the units of their plots.

    Raises:
        ConfigError: the model cannot be read.
    """
    from monitor.decision import rules_for
    from monitor.model import load_model

    model = load_model(path)
    rules = rules_for(model)
    theta1, theta2 = model.signature
    # The energy over 8 samples is judged; this is the steady change that reaches its limit.
    change = model.noise.residual * math.sqrt(rules.limit_8 / 8)
    return {
        "theta1_signature": theta1,
        "theta2_signature": theta2,
        "deviation_high": rules.factor,
        "change_low": -change,
        "change_high": change,
    }
