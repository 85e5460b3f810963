"""How a study is predicted: by a free run, or along its measured motion."""

from rigwatch.physics.engine.equations import (
    has_hidden_states,
    predicted_outputs,
    unjudged_along_motion,
)
from rigwatch.workbench.study import Study


def predicts_along_motion(study: Study) -> bool:
    """Whether a study is predicted along its measured motion."""
    if study.file.prediction != "auto":
        return study.file.prediction == "measured motion"
    model = study.model
    if model.rough or not (has_hidden_states(model) and predicted_outputs(model)):
        return False
    return not unjudged_along_motion(model)
