"""Openings of held-out recordings, which determine parameters that move between recordings.

A parameter with `per_recording` has a value of its own in a recording that is held out. If counted
samples determined it, it would be a free constant for every effect alike. The opening of such a
recording, its first part, determines it instead and is not counted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from rigwatch.workbench.data.columns import Columns
from rigwatch.workbench.study import Span, Study, judged_alone

LEAD = 0.1
"""Share of a held-out recording that is its opening."""


def without_openings(
    study: Study, tables: Sequence[Columns], horizon: int
) -> tuple[list[Columns], list[Columns], list[str]]:
    """Held-out recordings without their openings, the openings, and remarks.

    Args:
        study: its model has a fixed parameter for each held-out session of which no part is fitted.
        tables: the held-out recordings.
        horizon: samples of a window; an opening of a model with states is whole windows.
    """
    moving = [n for n, p in study.model.parameters.items() if p.is_of_opening]
    spans = study.file.held_out
    if not moving:
        return list(tables), [], []
    counted, openings, remarks = [], [], []
    for table, span, first in zip(tables, spans, _first_parts(study, spans), strict=True):
        lead = _lead(len(table), horizon if study.model.states else 1) if first else 0
        counted.append(_part(table, slice(lead, None)))
        if lead:
            openings.append(_part(table, slice(lead)))
            remarks.append(
                f"held out: the first {lead * table.dt:.3g} s of {span.session} determine what"
                " moves between recordings and are not counted"
            )
    return counted, openings, remarks


def _first_parts(study: Study, spans: Sequence[Span]) -> Iterator[bool]:
    """Whether each span is the first of a session of which no part is fitted."""
    alone = judged_alone(study.file)
    for span in spans:
        yield span.session in alone
        alone = [session for session in alone if session != span.session]


def _lead(samples: int, step: int) -> int:
    """Samples of an opening: whole windows, and fewer than the recording has."""
    wanted = -(-max(round(LEAD * samples), 2) // step) * step
    return min(wanted, (samples - 1) // step * step)


def _part(table: Columns, samples: slice) -> Columns:
    values = {name: column[samples] for name, column in table.values.items()}
    return replace(table, values=values, begun=table.begun + (samples.start or 0) * table.dt)
