"""How a study is predicted: by a free run, or along its measured motion."""

from rigwatch.physics.engine.equations import has_hidden_states, predicted_outputs
from rigwatch.workbench.study import Study


def predicts_along_motion(study: Study) -> bool:
    """Whether a study is predicted along its measured motion."""
    if study.file.prediction != "auto":
        return study.file.prediction == "measured motion"
    model = study.model
    return not model.rough and has_hidden_states(model) and bool(predicted_outputs(model))
