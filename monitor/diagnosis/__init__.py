"""Ranks the probable cause of an active alarm, in a separate process."""

from monitor.diagnosis.background_ranking import Explainer

__all__ = ["Explainer"]
