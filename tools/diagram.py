"""Draws boxes and arrows as SVG that reads well on a light and on a dark page.

    Picture(boxes, arrows, frames) ──svg──▶ text of the file

Positions are pixels of the picture. Colours follow the reader's system, and the background is drawn
with them, so that no viewer can put light text on a light page.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from itertools import pairwise

LINE = 17
"""Height of a line of text in a box [px]."""
STYLE = """
  text { font-family: "DejaVu Sans", system-ui, sans-serif; font-size: 13px; fill: #24292f }
  .title { font-weight: bold }
  .label, .note { font-size: 12px; fill: #57606a }
  .page { fill: #ffffff }
  rect { stroke-width: 1.5 }
  .process { fill: #ddf4ff; stroke: #0969da }
  .step { fill: #f6f8fa; stroke: #57606a }
  .data { fill: #fff8c5; stroke: #9a6700 }
  .result { fill: #dafbe1; stroke: #1a7f37 }
  .outside { fill: #ffffff; stroke: #57606a; stroke-dasharray: 5 4 }
  .frame { fill: none; stroke: #afb8c1; stroke-dasharray: 2 4 }
  .arrow { fill: none; stroke: #57606a; stroke-width: 1.5 }
  .head { fill: #57606a }
"""
DARK = """
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3 }
    .label, .note { fill: #9da7b1 }
    .page { fill: #0d1117 }
    .process { fill: #0c2d4d; stroke: #58a6ff }
    .step { fill: #1c2128; stroke: #9da7b1 }
    .data { fill: #3a2d05; stroke: #d4a72c }
    .result { fill: #0f2f1b; stroke: #3fb950 }
    .outside { fill: #0d1117; stroke: #9da7b1 }
    .frame { stroke: #545d68 }
    .arrow { stroke: #9da7b1 }
    .head { fill: #9da7b1 }
  }
"""


@dataclass(frozen=True)
class Box:
    """A box with a bold first line.

    Attributes:
        name: what arrows call it.
        x, y, width, height: upper left corner and size [px].
        title: first line.
        lines: further lines.
        kind: process, step, data, result, outside or frame.
    """

    name: str
    x: float
    y: float
    width: float
    height: float
    title: str
    lines: tuple[str, ...] = ()
    kind: str = "step"

    def at(self, side: str) -> tuple[float, float]:
        """A point of the edge: "left", "top", …, or "left:0.3" for a share of the side."""
        name, _, share = side.partition(":")
        s = float(share or 0.5)
        across, down = self.x + s * self.width, self.y + s * self.height
        return {
            "left": (self.x, down),
            "right": (self.x + self.width, down),
            "top": (across, self.y),
            "bottom": (across, self.y + self.height),
        }[name]


@dataclass(frozen=True)
class Arrow:
    """An arrow in straight pieces.

    Attributes:
        start, end: a box and a side: "daq.right", "bus.left:0.3".
        label: beside its middle.
        via: corners between [px].
        both: whether it has a head at either end.
    """

    start: str
    end: str
    label: str = ""
    via: tuple[tuple[float, float], ...] = ()
    both: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture.

    Attributes:
        width, height: [px].
        title: what it shows, for readers who do not see it.
        boxes: frames first, as later ones are drawn over earlier ones.
        arrows: between boxes.
    """

    width: int
    height: int
    title: str
    boxes: tuple[Box, ...]
    arrows: tuple[Arrow, ...]

    def svg(self) -> str:
        """The file."""
        named = {box.name: box for box in self.boxes}
        size = f'width="{self.width}" height="{self.height}"'
        view = f'viewBox="0 0 {self.width} {self.height}"'
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view} role="img">',
            f"<title>{escape(self.title)}</title>",
            f"<style>{STYLE}{DARK}</style>",
            f'<rect class="page" {size} rx="8"/>',
            *(part for box in self.boxes for part in _box(box)),
            *(part for arrow in self.arrows for part in _arrow(arrow, named)),
            "</svg>",
        ]
        return "\n".join(parts) + "\n"


def _box(box: Box) -> Iterator[str]:
    place = f'x="{box.x:g}" y="{box.y:g}" width="{box.width:g}" height="{box.height:g}"'
    yield f'<rect class="{box.kind}" {place} rx="5"/>'
    if box.kind == "frame":
        yield _text("note", box.x + 10, box.y + 17, box.title, "start")
        return
    middle = box.x + box.width / 2
    top = box.y + box.height / 2 - LINE * len(box.lines) / 2 + 4.5
    yield _text("title", middle, top, box.title)
    for number, line in enumerate(box.lines, start=1):
        yield _text("line", middle, top + LINE * number, line)


def _arrow(arrow: Arrow, named: dict[str, Box]) -> Iterator[str]:
    points = _level([_point(arrow.start, named), *arrow.via, _point(arrow.end, named)])
    corners = " ".join(f"{x:g},{y:g}" for x, y in points)
    yield f'<polyline class="arrow" points="{corners}"/>'
    yield _head(points[-2], points[-1])
    if arrow.both:
        yield _head(points[1], points[0])
    if arrow.label:
        pieces = list(pairwise(points))
        (x0, y0), (x1, y1) = max(pieces, key=lambda p: _length(*p))
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        yield (
            _text("label", x + 8, y + 4, arrow.label, "start")
            if x0 == x1
            else _text("label", x, y - 6, arrow.label)
        )


def _point(place: str, named: dict[str, Box]) -> tuple[float, float]:
    name, _, side = place.partition(".")
    return named[name].at(side)


def _level(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """A single piece that is nearly horizontal is made horizontal."""
    if len(points) == 2 and abs(points[0][1] - points[1][1]) < 8:
        middle = (points[0][1] + points[1][1]) / 2
        return [(x, middle) for x, _ in points]
    return points


def _length(a: tuple[float, float], b: tuple[float, float]) -> float:
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def _head(before: tuple[float, float], end: tuple[float, float]) -> str:
    """A triangle that points from `before` to `end`."""
    length = max(((end[0] - before[0]) ** 2 + (end[1] - before[1]) ** 2) ** 0.5, 1e-9)
    ux, uy = (end[0] - before[0]) / length, (end[1] - before[1]) / length
    back = (end[0] - 9 * ux, end[1] - 9 * uy)
    corners = (end, (back[0] - 4 * uy, back[1] + 4 * ux), (back[0] + 4 * uy, back[1] - 4 * ux))
    return f'<polygon class="head" points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in corners)}"/>'


def _text(kind: str, x: float, y: float, text: str, anchor: str = "middle") -> str:
    place = f'x="{x:g}" y="{y:g}" text-anchor="{anchor}"'
    return f'<text class="{kind}" {place}>{escape(text)}</text>'
