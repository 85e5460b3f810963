"""Reports of a study, as text for the terminal and as one self-contained HTML page."""

from rigwatch.workbench.report.charts import motion_units, residual_over_motion
from rigwatch.workbench.report.html_report import write_report
from rigwatch.workbench.report.text_report import (
    VERDICTS,
    at_its_bounds,
    base_lines,
    change_lines,
    comparison_lines,
    doubt_of,
    explanation_lines,
    next_command,
    next_step,
    number,
    region_data,
    region_lines,
    table,
)

__all__ = [
    "VERDICTS",
    "at_its_bounds",
    "base_lines",
    "change_lines",
    "comparison_lines",
    "doubt_of",
    "explanation_lines",
    "motion_units",
    "next_command",
    "next_step",
    "number",
    "region_data",
    "region_lines",
    "residual_over_motion",
    "table",
    "write_report",
]
