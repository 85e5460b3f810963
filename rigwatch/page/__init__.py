"""Web pages that hold everything and ask the network for nothing: the page and plots in SVG.

Shared by the reports of workbench and structures; it knows neither of them.
"""

from rigwatch.page.html import exact, figure, key, page, table
from rigwatch.page.svg import Plot, limits

__all__ = ["Plot", "exact", "figure", "key", "limits", "page", "table"]
