"""Modes of a structure as one web page: both figures of the thesis's Appendix A and the shares.

Figure A.1 counts springs of one stiffness together; figure A.2 takes apart those of the family
that is most to suspect.
"""

from html import escape

from rigwatch.page import exact, figure, page, table
from rigwatch.structures.model import StrainEnergy, Structure, by_family
from rigwatch.structures.report.mode_drawing import shares_svg

TOLD = 6
"""Springs that are named as most to suspect."""


def modes_html(structure: Structure, energy: StrainEnergy) -> str:
    """The page.

    Args:
        structure: as described.
        energy: of each of its springs.
    """
    families = energy.grouped(by_family(energy.springs))
    leading = families.ranking()[0]
    members = by_family(energy.springs)[leading]
    apart = energy.grouped({name: (name,) for name in members})
    return page(
        f"{structure.name}: modes",
        _header(structure, energy, leading),
        [
            ("families", "Springs of one stiffness together", _drawn(families)),
            ("members", f"Springs of {leading}, one by one", _drawn(apart)),
            ("shares", "Every spring in every mode", _shares(energy)),
        ],
    )


def _header(structure: Structure, energy: StrainEnergy, leading: str) -> str:
    ranking = ", ".join(energy.ranking()[:TOLD])
    span = f"{energy.omega[0]:.2f} to {energy.omega[-1]:.2f} rad/s"
    return (
        f'<p class="kicker">{escape(structure.name)}</p>'
        f"<h1>{escape(leading)} carries most strain energy</h1>"
        f'<p class="sub">{len(energy.omega)} modes from {span}. Most to suspect, by the number of'
        f" modes in which a spring carries over a fifth: {escape(ranking)}.</p>"
    )


def _drawn(energy: StrainEnergy) -> str:
    # The figure stands on white also in a dark page, and its words stay dark there.
    return f'<div style="--soft:#333">{figure(shares_svg(energy, "shares of strain energy"))}</div>'


def _shares(energy: StrainEnergy) -> str:
    rows = [
        [exact(omega), *(exact(share, f"{name}:{mode}") for name, share in zip(
            energy.springs, shares, strict=True))]
        for mode, (omega, shares) in enumerate(
            zip(energy.omega.tolist(), energy.shares.tolist(), strict=True), start=1)
    ]  # fmt: skip
    head = ["mode [rad/s]", *energy.springs]
    words = "U_ij = ½·φᵢᵀ·K_j·φᵢ for mass-normalised modes, as a share of its mode's total."
    return f'<p class="note">{words}</p>{table(head, rows, range(len(head)))}'
