"""Draws an examination in SVG: the residual with its threshold and instants, and rankings as bars.

Colours are variables of the page that holds the drawing, so that they follow its light or dark
theme.
"""

from collections.abc import Iterator
from html import escape

import numpy as np
from numpy.typing import NDArray

from rigwatch.structures.damage import Examination
from rigwatch.structures.damage_signals import band, pieces
from rigwatch.structures.locate import Candidate, Ranking

FloatArray = NDArray[np.float64]

WIDTH, LEFT, RIGHT = 920, 76, 12
HEIGHT, TOP, BOTTOM = 260, 26, 34
COLUMNS = 800
"""Points across a drawing; each holds the largest value of its samples."""
BAR, LABEL = 22, 150
SHOWN = 8


def statistic_svg(found: Examination) -> str:
    """Every watch's statistic over its threshold, with alarms and instants."""
    dt, end = found.reference.model.dt, len(found.reference.model)
    drawn = [(first * dt, part) for first, part in pieces(found)]
    axis = _Axis(0.0, end * dt, 1e-3, max(10.0, *(_peak(p) for _, p in drawn)))
    lines = [*axis.frame("statistic / threshold"), axis.level(1.0, "threshold")]
    lines += [axis.curve(t0, dt, p, "--line") for t0, p in drawn if len(p)]
    lines += _marks(found, axis)
    return _document(HEIGHT, lines, "test statistic over its threshold against time")


def residual_svg(found: Examination, signal: int) -> str:
    """One signal's residual beside the undamaged model, with the noise's band."""
    watch, dt = found.watches[0], found.reference.model.dt
    values = np.abs(np.nan_to_num(watch.residual[:, signal]))
    sigma = float(found.reference.sigma[signal])
    axis = _Axis(0.0, len(values) * dt, sigma / 10, max(_peak(values), 10 * sigma))
    name = found.reference.model.signals[signal]
    words, sizes = band(found)
    lines = [*axis.frame(f"|residual| of {name}"), axis.level(float(sizes[signal]), words)]
    lines += [axis.curve(0.0, dt, values, "--line"), *_marks(found, axis)]
    return _document(HEIGHT, lines, f"residual of {name} against time")


def ranking_svg(ranking: Ranking) -> str:
    """First-pass scores as bars; the class of the best in its colour."""
    shown = ranking.candidates[:SHOWN]
    top = max(c.score for c in shown) or 1.0
    lines: list[str] = []
    for row, candidate in enumerate(shown):
        lines += _bar(row, candidate, candidate.score / top, ranking.best)
    return _document(BAR * len(shown) + 8, lines, "places of the damage by score")


def _bar(row: int, candidate: Candidate, share: float, best: Candidate) -> Iterator[str]:
    y = 4 + row * BAR
    colour = "--line" if candidate is best else "--faint"
    colour = "--mark" if candidate.name in best.alike else colour
    width = max(1.0, share * (WIDTH - LABEL - 330))
    left = "" if np.isnan(candidate.chi2) else f", leaves χ²/f = {candidate.chi2:.3g}"
    words = f"score {candidate.score:.3g}{left}"
    yield f'<text x="{LABEL - 8}" y="{y + 14}" text-anchor="end">{escape(candidate.name)}</text>'
    yield (
        f'<rect x="{LABEL}" y="{y + 2}" width="{width:.1f}" height="{BAR - 6}"'
        f' style="fill:var({colour})"/>'
    )
    yield f'<text x="{LABEL + width + 8:.1f}" y="{y + 14}" class="quiet">{words}</text>'


class _Axis:
    """Time across, a logarithmic value up."""

    def __init__(self, start: float, end: float, low: float, high: float) -> None:
        self._start, self._end = start, end
        self._low, self._high = np.floor(np.log10(low)), np.ceil(np.log10(high))

    def x(self, time: float) -> float:
        share = (time - self._start) / (self._end - self._start)
        return LEFT + share * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        power = np.clip(np.log10(max(value, 1e-300)), self._low, self._high)
        share = (power - self._low) / max(self._high - self._low, 1.0)
        return float(HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM))

    def frame(self, title: str) -> Iterator[str]:
        yield f'<text x="{LEFT}" y="16">{escape(title)}</text>'
        every = max(1, int(self._high - self._low) // 6)
        for power in range(int(self._low), int(self._high) + 1, every):
            y = self.y(10.0**power)
            yield f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" class="grid"/>'
            yield f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end" class="quiet">{10.0**power:g}</text>'  # noqa: E501
        for time in _ticks(self._start, self._end):
            yield (
                f'<text x="{self.x(time):.1f}" y="{HEIGHT - 14}" text-anchor="middle"'
                f' class="quiet">{time:g} s</text>'
            )

    def level(self, value: float, words: str) -> str:
        y = self.y(value)
        return (
            f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" class="level"/><text x="{LEFT + 6}"'
            f' y="{y - 5:.1f}" class="marked">{escape(words)} {value:.3g}</text>'
        )

    def curve(self, start: float, dt: float, values: FloatArray, colour: str) -> str:
        step = max(1, len(values) // COLUMNS)
        points = [
            f"{self.x(start + i * dt):.1f} {self.y(float(np.max(values[i : i + step]))):.1f}"
            for i in range(0, len(values), step)
        ]
        return f'<path d="M{"L".join(points)}" style="fill:none;stroke:var({colour})"/>'

    def upright(self, time: float, words: str, dash: str) -> str:
        x = self.x(time)
        return (
            f'<path d="M{x:.1f} {TOP}V{HEIGHT - BOTTOM}" class="{dash}"/><text x="{x + 4:.1f}"'
            f' y="{TOP + 12}" class="marked">{escape(words)}</text>'
        )


def _marks(found: Examination, axis: _Axis) -> list[str]:
    """The instant of each damage."""
    return [
        axis.upright(d.instant.time, f"{d.ranking.best.name} {d.instant.time:.3f} s", "instant")
        for d in found.damages
    ]


def _ticks(start: float, end: float) -> list[float]:
    step = 10.0 ** np.floor(np.log10(end - start))
    step = step if (end - start) / step >= 4 else step / 4
    return [float(time) for time in np.arange(start, end, step)]


def _peak(values: FloatArray) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _document(height: int, lines: list[str], title: str) -> str:
    body = "\n".join(lines)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img"'
        f' aria-label="{escape(title)}">\n{body}\n</svg>'
    )
