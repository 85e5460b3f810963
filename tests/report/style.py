"""The colours of the reports' style, by their names."""

import re
from importlib.resources import files

STYLE = files("rigwatch.page").joinpath("style.css").read_text(encoding="utf-8")
WORDS = {"ink", "soft", "good", "warn", "refused", "held"}
"""Colours in which something is written."""
GROUNDS = {"paper", "card"}
LINES = {"line"}
"""Borders and grids, which nobody needs to see."""


def _colours(block: str) -> dict[str, str]:
    return dict(re.findall(r"--(\w+): (#[0-9a-f]{6});", block))


LIGHT, DARK, *_ = (_colours(block) for block in re.findall(r":root \{(.*?)\}", STYLE, re.DOTALL))
COLOURS = {"light": LIGHT, "dark": LIGHT | DARK}


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours, 1 to 21 (WCAG 2.2)."""
    low, high = sorted(_luminance(colour) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    parts = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    linear = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return sum(w * p for w, p in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
