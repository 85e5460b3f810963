"""What the screen takes from a model file: the signature and the limits that do not change."""

import math
from pathlib import Path


def marks_of(path: Path | str) -> dict[str, float]:
    """Figures by name, in the units of the plots in which they are drawn.

    Raises:
        ConfigError: the model cannot be read.
    """
    from monitor.decision import rules_for
    from monitor.model import load_model

    model = load_model(path)
    rules = rules_for(model)
    theta1, theta2 = model.signature
    # The energy over 8 samples is what is judged; this is the steady change that would reach it.
    change = model.noise.residual * math.sqrt(rules.limit_8 / 8)
    return {
        "theta1_signature": theta1,
        "theta2_signature": theta2,
        "deviation_high": rules.factor,
        "change_low": -change,
        "change_high": change,
    }
