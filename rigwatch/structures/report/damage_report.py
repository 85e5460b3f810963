"""An examination as one web page: no scripts, nothing from the network, readable on paper."""

from rigwatch.page import page as whole_page
from rigwatch.structures.damage import Examination, loudest
from rigwatch.structures.report import damage_drawing, damage_words


def page(found: Examination, record: str) -> str:
    """The examination of the record called `record` as an HTML document."""
    return whole_page(
        "rigwatch.structures.report",
        "damage.html",
        found=found,
        record=record,
        loudest=loudest(found),
        words=damage_words,
        drawing=damage_drawing,
    )
