"""The recorder process: writes the recorded topics of the bus to session files."""

from rigwatch.recorder.process import run

__all__ = ["run"]
