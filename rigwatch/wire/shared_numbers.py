"""Numbers of an object that compiled functions read and write, too.

array ──memoryview──▶ object.attribute   (Python's numbers, in a third of numpy's time)
  └──────────────────▶ compiled function, which gets all of an object's numbers as one array
"""

from typing import Any, Generic, TypeVar

import numpy as np

N = TypeVar("N", int, float)


class Shared(Generic[N]):
    """The number at `place` of a memory view of the object, as an attribute of it.

    Args:
        view: name of the object's attribute with the view, from `shared`.
        place: in it.
    """

    def __init__(self, view: str, place: int) -> None:
        self._view, self._place = view, place

    def __get__(self, one: object, _kind: type | None = None) -> N:
        number: N = getattr(one, self._view)[self._place]
        return number

    def __set__(self, one: object, number: N) -> None:
        getattr(one, self._view)[self._place] = number


def shared(count: int, kind: type[Any]) -> memoryview:
    """A view of so many zeros; `numpy.asarray` of it is the array."""
    return np.zeros(count, kind).data
