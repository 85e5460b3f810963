"""Candidates of a study: every effect at every compatible port, or one that is named."""

from rigwatch.physics.engine.equations import Effect
from rigwatch.physics.engine.fit import Recording
from rigwatch.physics.engine.score import Candidate, shaped, suits
from rigwatch.physics.engine.score import candidates as every_candidate
from rigwatch.workbench.data import port_sizes
from rigwatch.workbench.ranking.separate_recordings import check_ports
from rigwatch.workbench.study import Study


def candidates(study: Study, recording: Recording) -> list[Candidate]:
    """Every effect at every compatible port not yet in the model.

    Elective effects are included only if the study selects the whole library.

    Args:
        study: its model, its effects and those already accepted.
        recording: gives the size of the signals at the ports.
    """
    check_ports(study)
    ports, sizes = study.model.ports, port_sizes(study.model, recording)
    placed = {(a.effect, a.port) for a in study.file.effects}

    def effect_at(name: str, port: str) -> Effect | None:
        if (name, port) in placed or not suits(study.effects[name], ports[port], study.model):
            return None
        return study.effect_at(name, port).scaled(sizes[port])

    return every_candidate(ports, study.effects, effect_at, elective=study.file.whole_library)


def suitable(study: Study) -> tuple[list[str], list[str]]:
    """Effects that a port of the study's model suits: those that are ranked, and elective others.

    Args:
        study: its model and its effects.
    """
    names = [
        name
        for name, effect in study.effects.items()
        if any(suits(effect, port, study.model) for port in study.model.ports.values())
    ]
    elective = [n for n in names if study.effects[n].elective and not study.file.whole_library]
    return [name for name in names if name not in elective], elective


def shapes_of(study: Study, recording: Recording, effect: str, port: str) -> list[Candidate]:
    """One effect at one port in each of its shapes, elective or not."""
    check_ports(study)
    sizes = port_sizes(study.model, recording)[port]
    return shaped(effect, study.effect_at(effect, port).scaled(sizes), port)


def refining(
    study: Study, recording: Recording, effect: str, port: str, *, likened: bool = False
) -> list[Candidate]:
    """The elective effects that refine one effect at its port, in each of their shapes.

    Args:
        study, recording: as for `candidates`.
        effect, port: what is refined.
        likened: include those that the library calls similar to it: of what explains a part of an
            effect that is not ranked, the best need not be the one that it refines.
    """
    placed = {(a.effect, a.port) for a in study.file.effects}
    names = [
        name
        for name, other in study.effects.items()
        if other.elective and (name, port) not in placed
        if other.refines == effect or (likened and effect in other.confused_with)
        if suits(other, study.model.ports[port], study.model)
    ]
    return [c for name in names for c in shapes_of(study, recording, name, port)]
