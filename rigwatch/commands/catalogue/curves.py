"""Curves on the terminal, and as pictures: FILE.svg, FILE_2.svg, …"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import say

if TYPE_CHECKING:
    from rigwatch.workbench.catalogue import Curve


def plot_lines(curves: "Sequence[Curve]") -> list[str]:
    """The curves as text, a blank line before each."""
    from rigwatch.workbench.catalogue import text_plot

    return [line for curve in curves for line in ("", *text_plot(curve))]


def save_curves(target: Path, curves: "Sequence[Curve]", title: "Callable[[Curve], str]") -> None:
    """Draw each curve, under its title, into a file of its own."""
    from rigwatch.wire.new_file import write_new
    from rigwatch.workbench.catalogue import plotted

    for number, curve in enumerate(curves, start=1):
        file = target.with_name(f"{target.stem}{f'_{number}' if number > 1 else ''}.svg")
        write_new(file, plotted(curve, title(curve)), replace=True)
        say(f"drawn: {file}")
