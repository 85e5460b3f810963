"""Draws docs/pictures/NAME.svg from NAME.txt: `make docs` does it for all of them.

    1000 560  title
    name  x y width height  kind  first line | second line
    start.side -> end.side:share  via x,y x,y  : label

Empty lines separate the title, the boxes and the arrows; `<>` is an arrow with two heads.
"""

import re
import sys
from pathlib import Path

from tools.diagram import Arrow, Box, Picture

FOLDER = Path(__file__).parent.parent / "docs" / "pictures"
ARROW = re.compile(r"(\S+) (->|<>) (\S+)(?:  via ((?:\S+,\S+ ?)+))?(?: *: (.*))?")


def read(path: Path) -> Picture:
    """The picture that a text file describes."""
    head, boxes, arrows = path.read_text(encoding="utf-8").strip().split("\n\n")
    width, height, title = head.split(maxsplit=2)
    return Picture(
        int(width),
        int(height),
        title,
        tuple(map(_box, boxes.splitlines())),
        tuple(map(_arrow, arrows.splitlines())),
    )


def _box(line: str) -> Box:
    name, x, y, width, height, kind, text = line.split(maxsplit=6)
    title, *lines = (part.strip() for part in text.split("|"))
    return Box(name, float(x), float(y), float(width), float(height), title, tuple(lines), kind)


def _arrow(line: str) -> Arrow:
    found = ARROW.fullmatch(line)
    assert found is not None, line
    start, sign, end, via, label = found.groups()
    corners = tuple(_corner(text) for text in (via or "").split())
    return Arrow(start, end, (label or "").strip(), corners, both=sign == "<>")


def _corner(text: str) -> tuple[float, float]:
    x, y = text.split(",")
    return float(x), float(y)


def main() -> int:
    """Write the pictures."""
    for path in sorted(FOLDER.glob("*.txt")):
        path.with_suffix(".svg").write_text(read(path).svg(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
