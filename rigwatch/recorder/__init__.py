"""The recorder process: everything on the bus that is worth keeping goes into session files."""

from rigwatch.recorder.process import run

__all__ = ["run"]
