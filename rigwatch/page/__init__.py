"""Web pages that hold everything and ask the network for nothing: templates and plots in SVG.

Shared by the reports of workbench and structures; it knows neither of them.
"""

from rigwatch.page.html import page
from rigwatch.page.scale import limits
from rigwatch.page.svg import Plot

__all__ = ["Plot", "limits", "page"]
