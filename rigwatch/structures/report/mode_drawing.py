"""Draws shares of strain energy as grouped bars, in SVG: figures A.1 and A.2 of the thesis."""

from collections.abc import Iterator
from html import escape

from rigwatch.structures.model import StrainEnergy

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 860, 360, 56, 46, 56
COLOURS = ("#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#3ca951", "#a463f2", "#97bbf5", "#9c6b4e")


def shares_svg(energy: StrainEnergy, title: str) -> str:
    """One group of bars a mode, one bar a spring, as an SVG document."""
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"'
        ' font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<text x="{LEFT}" y="20" font-size="15">{escape(title)}</text>',
        *_legend(energy),
        *_grid(),
        *_bars(energy),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _y(share: float) -> float:
    return TOP + (1.0 - share) * (HEIGHT - TOP - BOTTOM)


def _legend(energy: StrainEnergy) -> Iterator[str]:
    step = (WIDTH - LEFT - 10) / max(len(energy.springs), 6)
    for index, name in enumerate(energy.springs):
        x = LEFT + index * step
        yield f'<rect x="{x:.1f}" y="30" width="10" height="10" fill="{_colour(index)}"/>'
        yield f'<text x="{x + 14:.1f}" y="39">{escape(name)}</text>'


def _grid() -> Iterator[str]:
    for percent in range(0, 101, 20):
        y = _y(percent / 100)
        yield f'<line x1="{LEFT}" x2="{WIDTH - 8}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>'
        yield f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{percent} %</text>'


def _bars(energy: StrainEnergy) -> Iterator[str]:
    modes, springs = energy.shares.shape
    group = (WIDTH - LEFT - 8) / modes
    bar = 0.84 * group / springs
    for i in range(modes):
        left = LEFT + (i + 0.08) * group
        for j in range(springs):
            share = float(energy.shares[i, j])
            yield (
                f'<rect x="{left + j * bar:.1f}" y="{_y(share):.1f}" width="{bar * 0.92:.1f}"'
                f' height="{_y(0.0) - _y(share):.1f}" fill="{_colour(j)}"><title>mode {i + 1},'
                f" {escape(energy.springs[j])}: {100 * share:.1f} %</title></rect>"
            )
        middle, omega = LEFT + (i + 0.5) * group, energy.omega[i]
        yield f'<text x="{middle:.1f}" y="{HEIGHT - 28}" text-anchor="middle">mode {i + 1}</text>'
        yield (
            f'<text x="{middle:.1f}" y="{HEIGHT - 12}" text-anchor="middle" fill="#666">'
            f"{omega:.1f} rad/s</text>"
        )


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]
