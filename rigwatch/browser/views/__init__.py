"""Pages and their parts, rendered from a study and the results on disk."""

from rigwatch.browser.views.at_rig import AtRig
from rigwatch.browser.views.editor_view import begun_model, checked, first_text
from rigwatch.browser.views.exports import figure_csv, figure_svg
from rigwatch.browser.views.pages import render
from rigwatch.browser.views.studies_view import listed, stamp, study_folders
from rigwatch.browser.views.study_state import State, state_of
from rigwatch.browser.views.study_view import candidate_html, parts_of

__all__ = [
    "AtRig",
    "State",
    "begun_model",
    "candidate_html",
    "checked",
    "figure_csv",
    "figure_svg",
    "first_text",
    "listed",
    "parts_of",
    "render",
    "stamp",
    "state_of",
    "study_folders",
]
