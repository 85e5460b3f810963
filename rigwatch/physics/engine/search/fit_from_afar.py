"""The fitting driver: a fit that reaches the best parameters from wherever it is told to begin.

A search says where to begin, the likeliest place first: `ShortHorizons` over windows with unknown
initial states, `WholeRuns` along the measured motion. Attempts are made until it has enough; one
that blows up is left, and the best of the others is kept.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.search.convergence import Convergence, convergence
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class Attempt:
    """Where one start has led.

    Attributes:
        begun: what it began from.
        fit: what was found.
        cost: what was minimised.
        error: scaled, root mean square.
        gradient: share of the cost that a further step promises, None where that is the squared
            error alone.
    """

    begun: str
    fit: Fit
    cost: float
    error: float
    gradient: float | None = None


class Search(Protocol):
    """Where fits begin, and when there are enough of them."""

    def attempts(self) -> Iterator[Callable[[], Attempt]]:
        """Attempts, the likeliest first; one raises a `ModelError` where it blows up."""

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether no further start is worth its time."""

    def near_noise(self, best: Attempt) -> bool:
        """Whether an error is so small that no other end could be much better."""


def fit_from_afar(search: Search) -> tuple[Fit, Convergence]:
    """The best of fits from several starts, and how it ended.

    Raises:
        ModelError: the recording is too short, or every start blows up.
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
    near = search.near_noise(best)
    return best.fit, convergence(
        best.fit, others, best.begun, near_noise=near, gradient=best.gradient
    )
