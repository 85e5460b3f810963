"""Monitors a test rig against a model of it, and finds the effects that the model lacks.

The workbench from Python, and in a notebook, where results display themselves:

    import rigwatch
    study = rigwatch.Study("emps")
    study.explain()
    study.add("coulomb")

Names are loaded on first use, so that commands do not wait for modules that they do not need.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from rigwatch.version import __version__

if TYPE_CHECKING:
    from rigwatch.workbench.api import Study

__all__ = ["Study", "__version__"]


def __getattr__(name: str) -> object:
    """A public name, from the workbench."""
    if name not in __all__:
        raise AttributeError(f"rigwatch has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module("rigwatch.workbench.api"), name)
