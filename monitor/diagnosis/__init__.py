"""Ranks the probable cause of an active alarm, in a separate process."""

from monitor.diagnosis.background_ranking import JOINED, Explainer

__all__ = ["JOINED", "Explainer"]
