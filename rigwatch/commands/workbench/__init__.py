"""Commands of the workbench."""

from rigwatch.commands.workbench.study_view import write_picture

__all__ = ["write_picture"]
