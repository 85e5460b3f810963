"""Bases of a study: the variants and elements of its model, judged by healthy recordings."""

from rigwatch.workbench.compare.bases.base_fit import Base
from rigwatch.workbench.compare.bases.base_search import Bases, find_base
from rigwatch.workbench.compare.bases.base_step import AT_NOISE
from rigwatch.workbench.compare.bases.model_form import variances_between_bases

__all__ = ["AT_NOISE", "Base", "Bases", "find_base", "variances_between_bases"]
