"""A mapping that keeps the most recently used items, in bounded memory."""

from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Recent(Generic[K, V]):
    """Values by key; those that are not asked for again make room for new ones.

    Two generations: a value that is asked for joins the younger one, and the older one is dropped
    as a whole when the younger one is full. Looking a value up changes nothing as a rule, and
    threads need no lock.

    Args:
        most: values in a generation.
        room: sum of their sizes.
    """

    def __init__(self, most: int, room: int) -> None:
        self._most, self._room = most, room
        self.clear()

    def grow(self, most: int, room: int) -> None:
        """Keep this much in a generation from now on."""
        self._most, self._room = most, room

    def clear(self) -> None:
        """Forget everything."""
        self._young: dict[K, tuple[V, int]] = {}
        self._old: dict[K, tuple[V, int]] = {}
        self._size = 0

    def __len__(self) -> int:
        return len(self._young.keys() | self._old.keys())

    def get(self, key: K) -> V | None:
        """The value of `key`, None if it is not kept."""
        if (found := self._young.get(key)) is not None:
            return found[0]
        if (found := self._old.get(key)) is None:
            return None
        self.put(key, *found)
        return found[0]

    def put(self, key: K, value: V, size: int) -> None:
        """Keep a value of this size."""
        if len(self._young) >= self._most or self._size + size > self._room:
            self._old, self._young, self._size = self._young, {}, 0
        self._young[key] = value, size
        self._size += size
