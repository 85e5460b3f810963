"""The dashboard: what the rig does, what the model expected, and what to do about the difference.

    messages ──▶ Dashboard.show ──▶ batches ──flush──▶ Rerun viewer
                     └─▶ AlarmBook, Survey ──▶ status text, layout

Only this package knows Rerun, and nothing here is imported by the other processes. Call
`require_rerun` before importing a module of this package that draws.
"""

import importlib.util

from rigwatch.wire.errors import MissingExtraError


def require_rerun() -> None:
    """Say in one plain line that the viewer is not installed.

    Raises:
        MissingExtraError: the package rerun-sdk is not installed.
    """
    if importlib.util.find_spec("rerun") is None:
        raise MissingExtraError("rerun-sdk", "dashboard", "the dashboard")
