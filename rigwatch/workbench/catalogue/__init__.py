"""Descriptions and drawings of the library's effects and of equation models.

`effect_curves` runs an effect along a sine and a step, `drawings` renders curves as SVG and text,
`model_report` checks whether a model file can work, `drafts` checks own files before they are
saved.
"""

from rigwatch.workbench.catalogue.drafts import Draft, draft_of_effects, draft_of_model
from rigwatch.workbench.catalogue.drawings import plotted, text_plot
from rigwatch.workbench.catalogue.effect_curves import Curve, effect_curves
from rigwatch.workbench.catalogue.findings import findings
from rigwatch.workbench.catalogue.model_report import ModelReport, inputs_of_run, model_report
from rigwatch.workbench.catalogue.problems import Problem

__all__ = [
    "Curve",
    "Draft",
    "ModelReport",
    "Problem",
    "draft_of_effects",
    "draft_of_model",
    "effect_curves",
    "findings",
    "inputs_of_run",
    "model_report",
    "plotted",
    "text_plot",
]
