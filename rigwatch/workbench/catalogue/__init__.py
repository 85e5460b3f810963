"""What there is to choose from, described and drawn: effects of the library, models of equations.

`effect_curves` runs an effect along a sine and a step, `drawings` draws curves as SVG and as text,
`model_report` says what a model's file holds and what in it cannot work.
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
