"""Writes the variants of a study's model that its healthy recordings support to the study."""

from collections.abc import Sequence

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study import Study, commit, use_variants, varied


def take_base(study: Study, variants: Sequence[str]) -> Study:
    """Write these variants to the study's file and its ledger; return the changed study.

    Raises:
        ModelError: effects have been accepted on another base, or variants exclude each other.
    """
    if study.file.effects:
        label = f"{study.file.effects[-1].effect}@{study.file.effects[-1].port}"
        raise ModelError(
            f"{study.folder}: found {label} accepted on the current base, expected a study without"
            " effects; `rigwatch undo` removes them"
        )
    varied(study, variants)
    changed = use_variants(study, variants)
    commit(study, changed, "base", variants=list(variants), before=list(study.file.variants))
    return changed
