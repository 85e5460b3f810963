"""Draws an examination: the test and the residual with bound and instants, and rankings as bars."""

import numpy as np

from rigwatch.page import Plot
from rigwatch.structures.damage import Examination, Ranking, band, pieces
from rigwatch.wire.arrays import FloatArray

HEIGHT = 260
SHOWN = 6


def statistic_svg(found: Examination) -> str:
    """Every watch's statistic over its threshold, with the instants."""
    dt, drawn = found.reference.model.dt, pieces(found)
    plot = _plot(found, "statistic / threshold", 1e-3, max(10.0, *(_peak(p) for _, p in drawn)))
    for first, part in drawn:
        plot.line((first + np.arange(len(part))) * np.float64(dt), part, "held")
    return _marked(plot, found, 1.0, "threshold")


def residual_svg(found: Examination, signal: int) -> str:
    """One signal's residual against the undamaged model, with the band of the noise."""
    values = np.abs(np.nan_to_num(found.watches[0].residual[:, signal]))
    sigma, name = float(found.reference.sigma[signal]), found.reference.model.signals[signal]
    plot = _plot(found, f"|residual| of {name}", sigma / 10, max(_peak(values), 10 * sigma))
    plot.line(np.arange(len(values)) * np.float64(found.reference.model.dt), values, "held")
    words, sizes = band(found)
    return _marked(plot, found, float(sizes[signal]), words)


def ranking_svg(ranking: Ranking) -> str:
    """Scores of the likeliest places as bars; what changed and its class in their colours."""
    shown = ranking.candidates[:SHOWN]
    alike = {name for changed in ranking.changed for name in changed.alike}
    top = 1.05 * max(c.score for c in shown) or 1.0
    names = [c.name for c in shown]
    title = "places of the damage by score"
    plot = Plot(title, (-0.5, len(shown) - 0.5), (0.0, top), "coefficient", "score",
                height=HEIGHT, names=names)  # fmt: skip
    for place, candidate in enumerate(shown):
        colour = "held" if candidate in ranking.changed else "measured"
        colour = "before" if candidate.name in alike else colour
        told = f"{candidate.name}: score {candidate.score:.3g}"
        plot.box((place - 0.35, place + 0.35), (0.0, candidate.score), colour, told)
    return plot.drawn()


def _plot(found: Examination, words: str, low: float, high: float) -> Plot:
    end = len(found.reference.model) * found.reference.model.dt
    ends = 10.0 ** np.floor(np.log10(low)), 10.0 ** np.ceil(np.log10(high))
    title = f"{words} against time"
    return Plot(title, (0.0, end), (float(ends[0]), float(ends[1])), "time [s]", words,
                height=HEIGHT, y_log=True)  # fmt: skip


def _marked(plot: Plot, found: Examination, level: float, words: str) -> str:
    """The plot with its bound and the instant of each damage."""
    plot.line(np.array(plot.x), np.full(2, level), "refused", dash="6 4")
    plot.text(plot.x[0], level, f"{words} {level:.3g}", "refused", up=5)
    for damage in found.damages:
        time = damage.instant.time
        names = ", ".join(c.name for c in damage.ranking.changed)
        plot.line(np.full(2, time), np.array(plot.y), "refused")
        plot.text(time, plot.y[1], f" {names} {time:.3f} s", "refused", up=-12)
    return plot.drawn()


def _peak(values: FloatArray) -> float:
    return float(np.max(np.abs(values), initial=0.0))
