"""Self-contained web pages that need no network: templates and SVG plots.

Shared by the reports of workbench and structures, and independent of both.
"""

from rigwatch.page.html import STYLE, page, templates
from rigwatch.page.scale import limits
from rigwatch.page.svg import Plot

__all__ = ["STYLE", "Plot", "limits", "page", "templates"]
