"""The fitting driver: finds the best parameters from any start.

A search supplies the starts, most promising first: `ShortHorizons` over windows with unknown
initial states, `WholeRuns` along the measured motion. Attempts are made until the search is
satisfied; diverging ones are skipped, and the best of the others is kept.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.search.convergence import Convergence, agrees, convergence
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class Attempt:
    """Result of one start.

    Attributes:
        begun: the start, in words.
        fit: the fit.
        cost: the minimised cost.
        error: scaled error, root mean square.
        gradient: predicted relative reduction of the cost by a further step.
    """

    begun: str
    fit: Fit
    cost: float
    error: float
    gradient: float


class Search(Protocol):
    """Starts of fits, and the stopping rule."""

    def attempts(self) -> Iterator[Callable[[], Attempt]]:
        """Attempts, most promising first; one that diverges raises a `ModelError`."""

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether no further start is needed."""

    def near_noise(self, best: Attempt) -> bool:
        """Whether an error is so small that no other optimum could be much better."""


def multi_start_fit(search: Search) -> tuple[Fit, Convergence]:
    """The best of fits from several starts, and its convergence.

    Raises:
        ModelError: the recording is too short, or every start diverges.
    """
    found: list[Attempt] = []
    trouble: ModelError | None = None
    for attempt in search.attempts():
        try:
            found.append(attempt())
        except ModelError as error:
            trouble = trouble or error
        if found and search.enough(found):
            break
    if not found:
        raise trouble or ModelError("found no start for the fit")
    best = min(found, key=lambda each: each.cost)
    others = [each.fit for each in found if each is not best]
    return best.fit, convergence(
        best.fit, others, best.begun, near_noise=search.near_noise(best),
        gradient=best.gradient, agreeing=agreeing(found, best),
    )  # fmt: skip


def agreeing(found: Sequence[Attempt], best: Attempt) -> int:
    """Number of attempts that reached the optimum of the best, including itself."""
    return sum(agrees(each.fit, best.fit, (each.error, best.error)) for each in found)
