"""Reports and drawings of identified, examined and vibrating structures."""

from rigwatch.structures.report.damage_report import page
from rigwatch.structures.report.damage_words import remark, too_little, verdict
from rigwatch.structures.report.identification_report import Findings, report_html
from rigwatch.structures.report.mode_drawing import shares_svg
from rigwatch.structures.report.modes_report import modes_html

__all__ = [
    "Findings",
    "modes_html",
    "page",
    "remark",
    "report_html",
    "shares_svg",
    "too_little",
    "verdict",
]
