"""Cache of fits between steps, keyed by the hashes of their inputs."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, TypeVar

from rigwatch.workbench.compare.compare import Comparison, comparison
from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.study import Study, check_data, stands_on

T = TypeVar("T")
FEW = 6


class Warm:
    """Cached fits of a study; a changed study finds none.

    Args:
        most: number of most recently used results to keep.
    """

    def __init__(self, most: int = FEW) -> None:
        self._most = most
        self._kept: OrderedDict[tuple[str, ...], Any] = OrderedDict()

    def get(self, key: tuple[str, ...], make: Callable[[], T]) -> T:
        """The result cached under `key`, computed if missing."""
        if key not in self._kept:
            self._kept[key] = make()
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        found: T = self._kept[key]
        return found

    def bench(self, study: Study) -> Bench:
        """The study's bench.

        Raises:
            ModelError: data have changed, or do not suit the model.
        """
        check_data(study)
        return self.get(("bench", stands_on(study)), lambda: open_bench(study))

    def comparison(self, study: Study) -> Comparison:
        """The study's errors.

        Raises:
            ModelError: data have changed, or do not suit the model.
        """
        key = ("comparison", stands_on(study))
        return self.get(key, lambda: comparison(self.bench(study)))
