"""Watches a test rig against a model of it and tells its people what the model is missing.

The workbench from Python, and in a notebook, where results display themselves:

    import rigwatch
    study = rigwatch.Study("emps")
    study.explain()
    study.add("coulomb")

Names are loaded when they are first used, so that no command waits for what it does not need.
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
