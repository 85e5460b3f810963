"""The dashboard: measured and modelled signals, alarms, and what to do about them.

    messages ──▶ Dashboard.show ──▶ batches ──flush──▶ Rerun viewer
                     └─▶ AlarmBook, Survey ──▶ status text, layout

Only this package depends on Rerun, and no other process imports it. Call `require_rerun` before
importing a module of this package that draws.
"""

import importlib.util

from rigwatch.wire.errors import MissingExtraError


def require_rerun() -> None:
    """Raise a plain one-line error if the viewer is not installed.

    Raises:
        MissingExtraError: the package rerun-sdk is not installed.
    """
    if importlib.util.find_spec("rerun") is None:
        raise MissingExtraError("rerun-sdk", "dashboard", "the dashboard")
