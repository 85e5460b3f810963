"""Draws shares of strain energy as grouped bars: figures A.1 and A.2 of the thesis."""

from rigwatch.page import Plot
from rigwatch.structures.model import StrainEnergy

COLOURS = 8
"""Colours of series in the page's style; more springs reuse them in order."""


def shares_plot(energy: StrainEnergy, title: str) -> Plot:
    """One group of bars per mode, one bar per spring."""
    modes, springs = energy.shares.shape
    names = [f"{mode}: {omega:.1f}" for mode, omega in enumerate(energy.omega.tolist(), start=1)]
    colours = [f"series{j % COLOURS + 1}" for j in range(springs)]
    plot = Plot(
        title, (-0.5, modes - 0.5), (0.0, 100.0), "mode: natural frequency [rad/s]",
        "share [%]", 860, 360, names=names, legend=list(zip(colours, energy.springs, strict=True)),
    )  # fmt: skip
    for mode, shares in enumerate(100 * energy.shares):
        for j, share in enumerate(shares.tolist()):
            left = mode - 0.42 + 0.84 * j / springs
            told = f"mode {mode + 1}, {energy.springs[j]}: {share:.1f} %"
            plot.box((left, left + 0.77 / springs), (0.0, share), colours[j], told)
    return plot


def shares_svg(energy: StrainEnergy, title: str) -> str:
    """The same as an SVG document."""
    return shares_plot(energy, title).document()
