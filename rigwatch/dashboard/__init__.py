"""The dashboard: measured and modelled signals, alarms, and what to do about them.

    messages ──▶ Dashboard.show ──▶ batches ──flush──▶ Rerun viewer
                     └─▶ AlarmBook, Survey ──▶ status text, layout

Only this package depends on Rerun, and no other process imports it. Call `require_rerun` before
importing a module of this package that draws.
"""

import importlib.util
from pathlib import Path

from rigwatch.wire.errors import MissingExtraError


def require_rerun() -> None:
    """Raise a plain one-line error if the viewer is not installed.

    Raises:
        MissingExtraError: the package rerun-sdk is not installed.
    """
    if importlib.util.find_spec("rerun") is None:
        raise MissingExtraError("rerun-sdk", "dashboard", "the dashboard")


def viewer_program() -> Path | None:
    """The viewer's executable, None if its package lacks it; a Python launcher would survive it."""
    found = importlib.util.find_spec("rerun_cli")
    if found is None or found.origin is None:
        return None
    program = Path(found.origin).with_name("rerun")
    return program if program.is_file() else None
