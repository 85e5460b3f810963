"""The effects that a study's healthy machine has, scaled to the signals of its recordings."""

from dataclasses import replace

from msgspec import structs

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.fit import Recording
from rigwatch.workbench.data.scales import port_sizes
from rigwatch.workbench.study import Element, Study, elements_of, varied


def with_elements(study: Study, recording: Recording) -> Study:
    """The study with the elements that its variants name in its model's equations.

    Args:
        study: as opened.
        recording: for the unmodified model; gives the size of the signals at the ports.

    Raises:
        ModelError: an effect's units do not suit its port.
    """
    named = elements_of(study.file.variants)
    if not named:
        return study
    sizes = port_sizes(study.model, recording)
    placed = tuple(_placed(study, element, sizes[element.port]) for element in named)
    return varied(replace(study, elements=placed), study.file.variants)


def _placed(study: Study, element: Element, sizes: dict[str, float]) -> Placement:
    effect = study.effect_at(element.effect, element.port).scaled(sizes)
    begun = {
        name: structs.replace(p, value=element.values.get(name, p.value))
        for name, p in effect.parameters.items()
    }
    return Placement(element.effect, structs.replace(effect, parameters=begun), element.port)
