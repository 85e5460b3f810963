"""The Rerun viewer: start it, find it, serve it as a page, take pictures of it."""

from rigwatch.dashboard.viewer.opening import Choice, open_viewer
from rigwatch.dashboard.viewer.picture import await_data, await_drawing, save_picture
from rigwatch.dashboard.viewer.viewer import RECORDING_MEMORY, ForeignViewer, Viewer, ViewerError

__all__ = [
    "RECORDING_MEMORY",
    "Choice",
    "ForeignViewer",
    "Viewer",
    "ViewerError",
    "await_data",
    "await_drawing",
    "open_viewer",
    "save_picture",
]
