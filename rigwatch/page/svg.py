"""Plots as inline SVG: axes with round ticks, lines, steps, marks, bars and maps, nothing else.

Colours are names of CSS variables, so that the page decides them, and a dark page has dark plots.
Numbers keep one decimal of a pixel: a page stays small.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, isfinite, log10

import numpy as np

from rigwatch.wire.arrays import FloatArray

MOST_POINTS = 900
"""Points of a line; longer ones show the highest and lowest sample of each pixel."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Data to pixels along one axis.

    Attributes:
        low, high: ends of the data.
        start, end: the same in pixels.
        log: whether decades are equally long.
    """

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def at(self, value: float) -> float:
        """The pixel of a value."""
        low, high, x = self.low, self.high, value
        if self.log:
            low, high, x = log10(low), log10(high), log10(max(value, 1e-300))
        return self.start + (x - low) / (high - low) * (self.end - self.start)

    def ticks(self, count: int = 5) -> list[float]:
        """Round values within the ends."""
        if self.log:
            return _decades(self.low, self.high)
        step = _round_step((self.high - self.low) / count)
        first, last = ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]


def _round_step(rough: float) -> float:
    power = 10.0 ** floor(log10(rough))
    return next(power * m for m in (1, 2, 5, 10) if power * m >= rough * 0.999)


def _decades(low: float, high: float) -> list[float]:
    first, last = ceil(log10(low) - 1e-9), floor(log10(high) + 1e-9)
    every = max(1, ceil((last - first + 1) / 7))
    return [10.0**k for k in range(first, last + 1, every)]


def limits(*values: FloatArray, zero: bool = False, room: float = 0.06) -> tuple[float, float]:
    """Ends of an axis that shows all finite values, with some room."""
    every = np.concatenate([np.ravel(v) for v in values])
    every = every[np.isfinite(every)]
    if not every.size:
        return 0.0, 1.0
    low, high = float(every.min()), float(every.max())
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    spare = room * (high - low or abs(high) or 1.0)
    return (low if zero and low == 0 else low - spare), (
        high if zero and high == 0 else high + spare
    )


def label(value: float) -> str:
    """A tick's number."""
    text = f"{value:.4g}"
    return text.replace("e-0", "e-").replace("e+0", "e").replace("-", "−")


@dataclass
class Plot:
    """One pair of axes and what is drawn in them.

    Attributes:
        title: what a screen reader says of it.
        x, y: ends of the axes.
        x_label, y_label: with the unit in brackets.
        width, height: [pixels].
        names: labels of categories at x = 0, 1, …, in place of numbers.
    """

    title: str
    x: tuple[float, float]
    y: tuple[float, float]
    x_label: str = ""
    y_label: str = ""
    width: int = 720
    height: int = 240
    x_log: bool = False
    y_log: bool = False
    names: Sequence[str] = ()
    left: int = 62
    _parts: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        bottom = self.height - (46 if self.x_label else 28)
        self.across = Scale(*self.x, self.left, self.width - 14, self.x_log)
        self.up = Scale(*self.y, bottom, 12, self.y_log)

    def line(self, x: FloatArray, y: FloatArray, colour: str, *, width: float = 1.5,
             dash: str = "", marks: bool = False, name: str = "") -> None:  # fmt: skip
        """A line that breaks where a value is not finite and stays within the axes."""
        path = " ".join(_segments(*_thinned(x, np.clip(y, *self.y)), self))
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        told = f"<title>{escape(name)}</title>" if name else ""
        self._parts.append(
            f'<path d="{path}" fill="none" stroke="var(--{colour})" stroke-width="{width}"'
            f' stroke-linejoin="round"{dashed}>{told}</path>'
        )
        if marks:
            for a, b in zip(x.tolist(), y.tolist(), strict=True):
                self.mark(a, b, colour, f"{name}: {b:.4g}")

    def mark(self, x: float, y: float, colour: str, told: str, *, hollow: bool = False) -> None:
        """A dot that says its number when it is pointed at."""
        fill = "var(--card)" if hollow else f"var(--{colour})"
        self._parts.append(
            f'<circle cx="{self.across.at(x):.1f}" cy="{self.up.at(y):.1f}" r="4.5" fill="{fill}"'
            f' stroke="var(--{colour})" stroke-width="2"><title>{escape(told)}</title></circle>'
        )

    def box(self, x: tuple[float, float], y: tuple[float, float], colour: str, told: str = "",
            opacity: float = 1.0) -> None:  # fmt: skip
        """A filled rectangle."""
        a, b = sorted(self.across.at(v) for v in x)
        c, d = sorted(self.up.at(v) for v in y)
        title = f"<title>{escape(told)}</title>" if told else ""
        self._parts.append(
            f'<rect x="{a:.1f}" y="{c:.1f}" width="{b - a:.1f}" height="{d - c:.1f}"'
            f' fill="var(--{colour})" fill-opacity="{opacity:.2f}">{title}</rect>'
        )

    def text(self, x: float, y: float, words: str, colour: str = "soft", *, anchor: str = "start",
             up: float = 0.0) -> None:  # fmt: skip
        """Words at a place of the data, `up` pixels above it."""
        self._parts.append(
            f'<text x="{self.across.at(x):.1f}" y="{self.up.at(y) - up:.1f}"'
            f' fill="var(--{colour})" text-anchor="{anchor}">{escape(words)}</text>'
        )

    def drawn(self) -> str:
        """The whole plot as an <svg> element."""
        head = (
            f'<svg viewBox="0 0 {self.width} {self.height}" role="img"'
            f' aria-label="{escape(self.title)}"><title>{escape(self.title)}</title>'
        )
        return head + "".join([*self._axes(), *self._parts]) + "</svg>"

    def _axes(self) -> list[str]:
        left, right = self.across.start, self.across.end
        low, high = self.up.start, self.up.end
        parts = []
        for value in self.up.ticks(max(4, round(self.height / 50))):
            y = self.up.at(value)
            parts.append(f'<path class="grid" d="M{left:.1f} {y:.1f}H{right:.1f}"/>')
            parts.append(
                f'<text x="{left - 7:.1f}" y="{y + 4:.1f}" text-anchor="end">{label(value)}</text>'
            )
        parts.append(f'<path class="axis" d="M{left:.1f} {low:.1f}H{right:.1f}"/>')
        for place, words in self._x_ticks():
            parts.append(f'<path class="axis" d="M{place:.1f} {low:.1f}v4"/>')
            parts.append(
                f'<text x="{place:.1f}" y="{low + 18:.1f}" text-anchor="middle">{words}</text>'
            )
        middle = (left + right) / 2
        parts.append(
            f'<text x="{middle:.1f}" y="{self.height - 6}" text-anchor="middle">'
            f"{escape(self.x_label)}</text>"
        )
        centre = (low + high) / 2
        parts.append(
            f'<text transform="translate(14 {centre:.1f}) rotate(-90)" text-anchor="middle">'
            f"{escape(self.y_label)}</text>"
        )
        return parts

    def _x_ticks(self) -> list[tuple[float, str]]:
        if self.names:
            return [(self.across.at(k), escape(name)) for k, name in enumerate(self.names)]
        wanted = max(2, round((self.width - self.left) / 90))
        return [(self.across.at(value), label(value)) for value in self.across.ticks(wanted)]


def _thinned(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    if len(x) <= MOST_POINTS:
        return x, y
    kept: list[int] = []
    for piece in np.array_split(np.arange(len(x)), MOST_POINTS // 2):
        part = y[piece]
        if np.isfinite(part).any():
            kept += sorted({int(piece[np.nanargmin(part)]), int(piece[np.nanargmax(part)])})
        else:
            kept.append(int(piece[0]))
    return x[kept], y[kept]


def _segments(x: FloatArray, y: FloatArray, plot: Plot) -> list[str]:
    pieces, broken = [], True
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if not (isfinite(a) and isfinite(b)):
            broken = True
            continue
        pieces.append(f"{'M' if broken else 'L'}{plot.across.at(a):.1f} {plot.up.at(b):.1f}")
        broken = False
    return pieces
