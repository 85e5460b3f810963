"""Plots as inline SVG: axes with round ticks, lines, steps, markers, bars and maps.

Colours are names of CSS variables, which the page defines, so that a dark page has dark plots.
Coordinates have one decimal of a pixel, to keep pages small.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

import numpy as np
from markupsafe import Markup

from rigwatch.page.html import STYLE, templates
from rigwatch.page.scale import Scale, label
from rigwatch.wire.arrays import FloatArray

MOST_POINTS = 900
"""Most points of a line; longer lines show the highest and lowest sample of each pixel."""
_TEMPLATE = templates().get_template("plot.svg")
_RULES = Markup("\n".join(re.findall(r"^svg.*?\}", STYLE, re.DOTALL | re.MULTILINE)))
_LIGHT = dict(re.findall(r"--(\w+): (#\w+);", STYLE.partition("@media")[0]))


@dataclass(frozen=True, slots=True)
class Shape:
    """One element of a plot.

    Attributes:
        tag: SVG tag.
        attributes: SVG attributes; None omits one.
        told: tooltip.
        words: its text.
    """

    tag: str
    attributes: Mapping[str, str | None]
    told: str = ""
    words: str = ""


@dataclass
class Plot:
    """One pair of axes with its content.

    Attributes:
        title: description for screen readers.
        x, y: ends of the axes.
        x_label, y_label: with the unit in brackets.
        width, height: [pixels].
        names: category labels at x = 0, 1, … in place of numbers.
        left: left edge of the axes [pixels].
        legend: colours and their labels, above the axes.
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
    legend: Sequence[tuple[str, str]] = ()
    shapes: list[Shape] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        bottom = self.height - (46 if self.x_label else 28)
        self.across = Scale(*self.x, self.left, self.width - 14, self.x_log)
        self.up = Scale(*self.y, bottom, 26 if self.legend else 12, self.y_log)

    def line(self, x: FloatArray, y: FloatArray, colour: str, *, width: float = 1.5,
             dash: str = "", marks: bool = False, name: str = "") -> None:  # fmt: skip
        """A line, broken at values that are not finite and clipped to the axes."""
        path = " ".join(_segments(*_thinned(x, np.clip(y, *self.y)), self))
        drawn = {"d": path, "fill": "none", "stroke": f"var(--{colour})",
                 "stroke-width": f"{width}", "stroke-linejoin": "round",
                 "stroke-dasharray": dash or None}  # fmt: skip
        self.shapes.append(Shape("path", drawn, name))
        if marks:
            for a, b in zip(x.tolist(), y.tolist(), strict=True):
                self.mark(a, b, colour, f"{name}: {b:.4g}")

    def mark(self, x: float, y: float, colour: str, told: str, *, hollow: bool = False) -> None:
        """A dot with its value as a tooltip."""
        ring = f"var(--{colour})"
        drawn = {"cx": _px(self.across.at(x)), "cy": _px(self.up.at(y)), "r": "4.5",
                 "fill": "var(--card)" if hollow else ring, "stroke": ring,
                 "stroke-width": "2"}  # fmt: skip
        self.shapes.append(Shape("circle", drawn, told))

    def box(self, x: tuple[float, float], y: tuple[float, float], colour: str, told: str = "",
            opacity: float = 1.0) -> None:  # fmt: skip
        """A filled rectangle."""
        a, b = sorted(self.across.at(v) for v in x)
        c, d = sorted(self.up.at(v) for v in y)
        drawn = {"x": _px(a), "y": _px(c), "width": _px(b - a), "height": _px(d - c),
                 "fill": f"var(--{colour})", "fill-opacity": f"{opacity:.2f}"}  # fmt: skip
        self.shapes.append(Shape("rect", drawn, told))

    def text(self, x: float, y: float, words: str, colour: str = "soft", *, anchor: str = "start",
             up: float = 0.0) -> None:  # fmt: skip
        """Text at a data point, `up` pixels above it."""
        drawn = {"x": _px(self.across.at(x)), "y": _px(self.up.at(y) - up),
                 "fill": f"var(--{colour})", "text-anchor": anchor}  # fmt: skip
        self.shapes.append(Shape("text", drawn, words=words))

    def drawn(self) -> Markup:
        """The plot as an <svg> element, coloured by its page."""
        return Markup(_TEMPLATE.render(plot=self, rules=""))

    def document(self) -> str:
        """The plot as a file, in a light page's colours, as only browsers support CSS variables."""
        text = _TEMPLATE.render(plot=self, rules=_RULES)
        return re.sub(r"var\(--(\w+)\)", lambda found: _LIGHT[found[1]], text)

    def y_ticks(self) -> list[tuple[float, str]]:
        """Pixel and label of each tick of the vertical axis."""
        wanted = max(4, round(self.height / 50))
        return [(self.up.at(value), label(value)) for value in self.up.ticks(wanted)]

    def x_ticks(self) -> list[tuple[float, str]]:
        """Pixel and label of each tick of the horizontal axis."""
        if self.names:
            return [(self.across.at(k), name) for k, name in enumerate(self.names)]
        wanted = max(2, round((self.width - self.left) / 90))
        return [(self.across.at(value), label(value)) for value in self.across.ticks(wanted)]


def _px(pixels: float) -> str:
    return f"{pixels:.1f}"


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
