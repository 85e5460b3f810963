"""The part of the residual that each candidate explains, per sample, to first order.

The score test's projected directions are stored for the training samples, so that the preview of a
candidate and the ranking of candidates in a region need no further fit.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rigwatch.browser.signals import Pyramid, Trace
from rigwatch.physics.engine.score import Candidate
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Bench, sample_numbers
from rigwatch.workbench.ranking import Ranked, score_all

MOST = 20_000
"""Most samples stored; longer recordings are decimated."""


def write_directions(folder: Path, bench: Bench, rows: Sequence[Ranked]) -> None:
    """Write the part that every row explains, in each channel's unit."""
    base = bench.base.train
    found = [_candidate(row) for row in rows]
    scores = score_all(bench.data, bench.base, found)
    residual = np.nan_to_num(base.residuals / base.scale).ravel()
    along = scores.units * (scores.units.T @ residual)
    outputs = base.residuals.shape[-1]
    taken = along.reshape(-1, outputs, len(rows)) * base.scale[:, None]
    left = base.residuals.reshape(-1, outputs)
    every = max(1, -(-len(left) // MOST))
    times = sample_numbers(bench.data.train, len(left)) * bench.data.train.dt
    count = min(len(times), len(left))
    np.save(folder / "taken.npy", np.ascontiguousarray(taken[:count:every].T, np.float32))
    np.save(folder / "residual.npy", np.ascontiguousarray(left[:count:every].T, np.float32))
    np.save(folder / "scale.npy", base.scale)
    np.save(folder / "times.npy", times[:count:every])
    (folder / "labels.txt").write_text("\n".join(row.label for row in rows), encoding="utf-8")


def _candidate(row: Ranked) -> Candidate:
    effect = row.placement.effect
    shape = {name: value for name, value in row.start.items() if name != effect.strength}
    return Candidate(row.effect, effect, row.port, shape)


class Directions:
    """Reads the stored parts.

    Args:
        folder: in which they were written.
    """

    def __init__(self, folder: Path) -> None:
        self.labels = (folder / "labels.txt").read_text(encoding="utf-8").splitlines()
        self.times: FloatArray = np.load(folder / "times.npy")
        self._taken = np.load(folder / "taken.npy", mmap_mode="r")
        self._residual: FloatArray = np.load(folder / "residual.npy")
        self._scale: FloatArray = np.load(folder / "scale.npy")

    @property
    def channels(self) -> int:
        """Number of channels."""
        return len(self._residual)

    def left(self, label: str, channel: int) -> FloatArray:
        """The residual minus the part that the candidate explains, of one channel, shape (n,)."""
        taken = self._taken[self.labels.index(label), channel]
        return np.asarray(self._residual[channel] - taken, np.float64)

    def trace(self, label: str, channel: int) -> Trace:
        """The remaining residual as a chart line."""
        return Trace(Pyramid(self.left(label, channel).astype(np.float32)), self.times)

    def explained(self, spans: FloatArray) -> dict[str, float]:
        """Share of the residual's energy that each explains within spans of time.

        Args:
            spans: start and end of each [s], shape (spans, 2), ascending.
        """
        place = np.searchsorted(spans[:, 0], self.times, "right") - 1
        inside = (place >= 0) & (self.times <= spans[np.maximum(place, 0), 1])
        residual = np.nan_to_num(self._residual[:, inside] / self._scale[:, None])
        taken = self._taken[:, :, inside] / self._scale[:, None]
        before = max(float(np.sum(residual**2)), 1e-300)
        after = np.sum((residual - taken) ** 2, axis=(1, 2))
        return dict(zip(self.labels, (1 - after / before).tolist(), strict=True))
