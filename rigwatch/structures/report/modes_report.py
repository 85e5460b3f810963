"""Modes of a structure as one web page: both figures of the thesis's Appendix A and the shares.

Figure A.1 counts springs of one stiffness together; figure A.2 splits the family that
is most suspect.
"""

from rigwatch.page import page
from rigwatch.structures.model import StrainEnergy, Structure, by_family
from rigwatch.structures.report.mode_drawing import shares_plot

NAMED = 6
"""Number of springs named as most suspect."""


def modes_html(structure: Structure, energy: StrainEnergy) -> str:
    """The page.

    Args:
        structure: the structure.
        energy: strain energy of each of its springs.
    """
    families = energy.grouped(by_family(energy.springs))
    leading = families.ranking()[0]
    members = by_family(energy.springs)[leading]
    apart = energy.grouped({name: (name,) for name in members})
    title = "shares of strain energy"
    return page(
        "rigwatch.structures.report",
        "modes.html",
        name=structure.name,
        energy=energy,
        leading=leading,
        suspects=energy.ranking()[:NAMED],
        families=shares_plot(families, title).drawn(),
        members=shares_plot(apart, title).drawn(),
    )
