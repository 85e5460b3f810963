"""Pages and their parts, rendered from a study and the results on disk."""

from rigwatch.browser.views.exports import figure_csv, figure_svg
from rigwatch.browser.views.pages import render
from rigwatch.browser.views.studies_view import listed
from rigwatch.browser.views.study_state import State, state_of
from rigwatch.browser.views.study_view import candidate_html, parts_of

__all__ = [
    "State",
    "candidate_html",
    "figure_csv",
    "figure_svg",
    "listed",
    "parts_of",
    "render",
    "state_of",
]
