"""Damage of a structure: when it begins, which spring is damaged, and what stiffness remains."""

from rigwatch.structures.damage import signals
from rigwatch.structures.damage.detector import rounded
from rigwatch.structures.damage.examination import Damage, Examination, Settings, examine
from rigwatch.structures.damage.innovations import Innovations
from rigwatch.structures.damage.location import Ranking
from rigwatch.structures.damage.signals import band, loudest, pieces
from rigwatch.structures.damage.spring_model import FINER
from rigwatch.structures.damage.threshold import CumulativeSum, threshold_for
from rigwatch.structures.damage.undamaged_reference import LEAST, Figure, Reference, reference

__all__ = [
    "FINER",
    "LEAST",
    "CumulativeSum",
    "Damage",
    "Examination",
    "Figure",
    "Innovations",
    "Ranking",
    "Reference",
    "Settings",
    "band",
    "examine",
    "loudest",
    "pieces",
    "reference",
    "rounded",
    "signals",
    "threshold_for",
]
