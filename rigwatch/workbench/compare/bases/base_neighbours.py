"""Bases one step away from another: each further variant of the model, and likely elements.

Elements are effects of the library that a healthy machine may have. Those at the model's ports are
scored on what the base leaves of the healthy recording, and the most promising are tried.
"""

from collections.abc import Container
from dataclasses import replace

from msgspec import structs

from rigwatch.physics.engine.equations import RATE, TIME, Effect, Placement, names_in, neighbours
from rigwatch.physics.engine.fit import beginning, evaluate
from rigwatch.workbench.compare.bases.base_fit import PART, Tried
from rigwatch.workbench.data import Data
from rigwatch.workbench.ranking import Ranked, candidates, scored
from rigwatch.workbench.study import Element, Study, elements_of, varied, written_variants

LIKELY = 4
"""Largest number of elements tried at a time."""
LEAST = 0.05
"""Smallest share of the residual's energy that an element has to explain, to first order."""


def with_one_variant_more(study: Study) -> list[tuple[str, ...]]:
    """Names of variants and elements, with one more variant in place of those that it excludes."""
    names = study.file.variants
    elements = [str(element) for element in elements_of(names)]
    return [(*elements, *own) for own in neighbours(study.model, written_variants(names))]


def further_variants(at: Tried, rejected: Container[str]) -> list[Study]:
    """Studies with one more variant, replacing those that it excludes.

    Args:
        at: the base.
        rejected: variants that are not tried again.
    """
    sets = with_one_variant_more(at.study)
    return [varied(at.study, names) for names in sets if names[-1] not in rejected]


def further_elements(at: Tried, rejected: Container[str]) -> list[Study]:
    """Studies with one more element, of those that its base along the motion speaks for.

    Args:
        at: the base.
        rejected: elements that are not tried again.
    """
    return [_with(at.study, row) for row in _likely(at, rejected)]


def _likely(at: Tried, rejected: Container[str]) -> list[Ranked]:
    """The most promising effects, best first."""
    part = beginning(at.data.train, PART)
    fit = evaluate(at.fitted.train, part, len(part), at.fitted.substeps)
    fitted = replace(at.fitted, train=fit, held_out=fit, horizon=len(part))
    data = Data(part, part, None, len(part), (), along_motion=True)
    known = {element.label for element in elements_of(at.study.file.variants)}
    found = [
        candidate
        for candidate in candidates(at.along, part)
        if candidate.label not in known
        and candidate.label not in rejected
        and _may_be_healthy(candidate.effect)
    ]
    rows = scored(at.along, data, fitted, found)
    return [row for row in rows if row.explained > LEAST][:LIKELY]


def _may_be_healthy(effect: Effect) -> bool:
    """Whether it describes a lasting property of a machine, in continuous time."""
    texts = [effect.expression, *(state.derivative for state in effect.states.values())]
    named = set().union(*(names_in(text, "effect") for text in texts if text))
    return not effect.sampled and not named & {TIME, RATE}


def _with(study: Study, row: Ranked) -> Study:
    """The study with an element that starts from its score."""
    effect = row.placement.effect
    begun = {
        name: structs.replace(p, value=row.start.get(name, p.value))
        for name, p in effect.parameters.items()
    }
    placed = Placement(row.effect, structs.replace(effect, parameters=begun), row.port)
    free = [n for n, p in effect.parameters.items() if p.role in ("strength", "shape")]
    element = Element(row.effect, row.port, {n: row.start[n] for n in free if n in row.start})
    elements = (*study.elements, placed)
    return varied(replace(study, elements=elements), (*study.file.variants, str(element)))
