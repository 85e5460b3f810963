"""Long signals for a chart of a few hundred columns: a pyramid of extremes on disk."""

from rigwatch.browser.signals.pyramid import Columns, Pyramid
from rigwatch.browser.signals.trace import Trace, open_trace, write_trace

__all__ = ["Columns", "Pyramid", "Trace", "open_trace", "write_trace"]
