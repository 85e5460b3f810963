"""What is probably missing when an alarm stands: ranked in a process of its own."""

from monitor.diagnosis.background_ranking import Explainer

__all__ = ["Explainer"]
