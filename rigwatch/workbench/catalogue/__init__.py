"""Descriptions and drawings of the library's effects and of equation models.

`effect_curves` runs an effect along a sine and a step, `drawings` renders curves as SVG and text,
`model_report` checks whether a model file can work.
"""

from rigwatch.workbench.catalogue.drawings import plotted, text_plot
from rigwatch.workbench.catalogue.effect_curves import Curve, effect_curves
from rigwatch.workbench.catalogue.effect_table import KINDS, described, listed, markdown
from rigwatch.workbench.catalogue.model_report import ModelReport, model_report

__all__ = [
    "KINDS",
    "Curve",
    "ModelReport",
    "described",
    "effect_curves",
    "listed",
    "markdown",
    "model_report",
    "plotted",
    "text_plot",
]
