"""How a study is predicted: by a free run, or along its measured motion."""

from rigwatch.physics.engine.equations import (
    Model,
    has_hidden_states,
    measured_states,
    predicted_outputs,
    unjudged_along_motion,
)
from rigwatch.workbench.study import Study

FORM = (
    "predicted along the measured motion: {shown} drive the model, {hidden} are simulated;"
    ' prediction = "free" as the first line of the study predicts every output by a free run'
)


def predicts_along_motion(study: Study) -> bool:
    """Whether a study is predicted along its measured motion."""
    if study.file.prediction != "auto":
        return study.file.prediction == "measured motion"
    model = study.model
    if model.rough or not (has_hidden_states(model) and predicted_outputs(model)):
        return False
    return not unjudged_along_motion(model)


def learns_from_healthy(study: Study) -> bool:
    """Whether a study's model is rough and extended by terms learned along the measured motion."""
    if study.file.prediction != "auto":
        return False
    return study.model.rough and has_hidden_states(study.model)


def form_along_motion(model: Model) -> str:
    """What drives a model along its measured motion and what is simulated, in words."""
    shown = [state.name for state in measured_states(model)]
    hidden = [name for name in model.states if name not in shown]
    return FORM.format(shown=", ".join(shown), hidden=", ".join(hidden) or "no states")
