"""Monitors a test rig against a model of it, and finds the effects that the model lacks.

The workbench from Python, and in a notebook, where results display themselves:

    import rigwatch
    study = rigwatch.Study("emps")
    study.explain()
    study.add("coulomb")

Work over many recordings, on any `concurrent.futures.Executor`: `rigwatch.map`.

Names are loaded on first use, so that commands do not wait for modules that they do not need.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from rigwatch.version import __version__

if TYPE_CHECKING:
    from rigwatch.batch import map_recordings as map  # noqa: A004
    from rigwatch.workbench.api import Study

__all__ = ["Study", "__version__", "map"]
_PLACES = {
    "Study": ("rigwatch.workbench.api", "Study"),
    "map": ("rigwatch.batch", "map_recordings"),
}


def __getattr__(name: str) -> object:
    """A public name, from its room."""
    if name not in _PLACES:
        raise AttributeError(f"rigwatch has no {name!r}; it has {', '.join(__all__)}")
    room, inside = _PLACES[name]
    return getattr(import_module(room), inside)
