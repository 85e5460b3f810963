"""Horizons over which a fit goes on its way to its own one."""

from rigwatch.physics.engine.fit import Recording

GROWTH = 4
"""Ratio of successive horizons that grow."""
FEWEST = 8
"""Samples of the shortest horizon."""
LONGER = 8
"""Ratio of the longer horizon to the fit's own."""


def growing_horizons(horizon: int) -> list[int]:
    """Horizons before the full one, shortest first."""
    found: list[int] = []
    while horizon // GROWTH >= FEWEST:
        horizon //= GROWTH
        found.append(horizon)
    return found[::-1]


def longer_horizons(recording: Recording, horizon: int) -> list[int]:
    """A horizon over which fewer initial states are free; none if a recording is too short."""
    shortest = min(part.stop - part.start for part in recording.slices)
    return [min(LONGER * horizon, shortest)] if shortest >= 2 * horizon else []
