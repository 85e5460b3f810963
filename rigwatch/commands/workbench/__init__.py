"""Commands of the workbench."""

from rigwatch.commands.workbench.study_view import write_views

__all__ = ["write_views"]
