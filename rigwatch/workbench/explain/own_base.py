"""Replaces a base that does not describe the healthy rig by one that does, if there is one.

The healthy recordings alone choose it, before the recordings with the fault are looked at. The
study's file is not changed; the verdict says which base it is judged on and how to keep it.
"""

from dataclasses import replace

from msgspec import structs

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, find_base, open_bench
from rigwatch.workbench.explain.adequacy import inadequate
from rigwatch.workbench.explain.verdict import Verdict, not_converged
from rigwatch.workbench.ranking import Progress
from rigwatch.workbench.study import Study, elements_of, varied

JUDGED_ON = (
    "judged on the model with {names}, which the healthy recording asks for; to keep it:"
    ' rigwatch study base {study} --take "{names}"'
)
CHANGE = "the healthy machine has {label} already: what is missing is more of it"


def with_adequate_base(bench: Bench, progress: Progress) -> Bench:
    """The bench, or one on a base that the healthy recordings ask for if its own is inadequate.

    Args:
        bench: of a study; one with accepted effects keeps its base.
        progress: called with a line of text as each fit begins.
    """
    study = bench.study
    if not _is_inadequate(bench) or not _may_search(bench):
        return bench
    progress("the model does not describe the healthy rig: searching for a better base")
    try:
        found = find_base(study, progress)
        names = found.enough.variants
        if set(names) == set(study.file.variants):
            return bench
        chosen = varied(study, names)
        file = structs.replace(chosen.file, start=found.start | dict(study.file.start))
        progress(f"fitting the model with {', '.join(names)}")
        better = open_bench(replace(chosen, file=file))
    except ModelError:
        return bench
    if _is_inadequate(better):
        return bench
    told = JUDGED_ON.format(names=", ".join(names), study=study.folder)
    remarks = (*better.data.remarks, told)
    return replace(better, data=replace(better.data, remarks=remarks))


def with_change_told(study: Study, found: Verdict) -> Verdict:
    """The verdict, which says so if it names an element that the base has already."""
    labels = {element.label for element in elements_of(study.file.variants)}
    named = sorted(labels & {*found.members})
    if not named:
        return found
    return replace(found, text=f"{found.text}; {CHANGE.format(label=named[0])}")


def _may_search(bench: Bench) -> bool:
    study = bench.study
    return bool(bench.data.along_motion and study.model.variants and study.file.healthy) and not (
        study.file.effects or study.model.rough
    )


def _is_inadequate(bench: Bench) -> bool:
    bare, kept = bench.bare, bench.study.kept
    ended = {
        "the model to the healthy recording": bare.convergence if bare else None,
        "the kept parameters to the healthy recording": kept.convergence if kept else None,
    }
    return (not_converged(ended) or inadequate(bench)) is not None
