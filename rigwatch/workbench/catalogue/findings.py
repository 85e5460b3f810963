"""Findings of a model's check in words, the same at the command line and in the browser."""

from rigwatch.workbench.catalogue.model_report import ModelReport
from rigwatch.workbench.catalogue.port_report import variables_known

SEVERE = ("unused", "tied")


def findings(report: ModelReport) -> dict[str, tuple[tuple[str, ...], str]]:
    """The names that something is to be said of, and what, by the report's field."""
    said = {
        "unused": "used in no equation and at no port",
        "unseen": "no output depends on it, so no recording can determine it",
        "tied": "the outputs cannot distinguish it from another of these",
        "growing": "moves away from where the file lets it start by itself, ever faster: a term of"
        " the equations may have the wrong sign",
        "start": "no channel measures it: a fit estimates its initial value from the outputs",
        "absolute": "a temperature that multiplies something: 0 degC are 273.15 K; give a"
        " difference in K",
        "unbounded": "fixed and without bounds, as constants may be: a study can give any value;"
        " with low = 0.0 a negative one is refused",
        "unread": "no effect of the library uses a variable of this name; theirs are"
        f" {', '.join(sorted(variables_known()))}",
    }
    return {kind: (getattr(report, kind), what) for kind, what in said.items()}
