"""Style, templates and drawings that the reports share."""

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hatchling.builders.wheel import WheelBuilder

from rigwatch.page import Plot
from tests.report.style import COLOURS, GROUNDS, LINES, STYLE, WORDS, contrast

ROOT = Path(__file__).parents[2]
PAGE_FILES = (".html", ".css", ".svg")


@pytest.mark.parametrize("mode", COLOURS)
def test_words_and_drawings_stand_out_from_what_they_stand_on(mode: str) -> None:
    colours = COLOURS[mode]
    drawn = colours.keys() - WORDS - GROUNDS - LINES
    assert len(drawn) > 10
    pale = {name: contrast(colours[name], colours["card"]) for name in drawn}
    assert {name: ratio for name, ratio in pale.items() if ratio < 3.0} == {}
    for ground in GROUNDS:
        pale = {name: contrast(colours[name], colours[ground]) for name in WORDS}
        assert {name: ratio for name, ratio in pale.items() if ratio < 4.5} == {}


def test_a_contrast_is_that_of_the_standard() -> None:
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


def test_every_colour_is_a_name_that_both_modes_have() -> None:
    assert set(re.findall(r"[^-]color: var\(--(\w+)\)", STYLE)) <= WORDS
    assert set(re.findall(r"var\(--(\w+)\)", STYLE)) <= COLOURS["light"].keys()
    _, light, dark = STYLE.split(":root", 2)
    names = [re.findall(r"--(\w+):", block.partition("}")[0]) for block in (light, dark)]
    assert sorted(names[0]) == sorted(names[1])


def test_a_drawing_as_a_file_has_its_style_and_escapes_its_words() -> None:
    plot = Plot("a & b", (0, 1), (0, 1), "<x>", legend=[("series1", "<one>")])
    plot.line(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "series1", name='"quoted" & <told>')
    plot.text(0.5, 0.5, "</svg>")
    document = ElementTree.fromstring(plot.document())
    assert document.get("aria-label") == "a & b"
    words = [element.text for element in document.iter() if element.text]
    assert {"a & b", "<x>", "<one>", '"quoted" & <told>', "</svg>"} <= set(words)
    assert COLOURS["light"]["series1"] in plot.document()
    assert "var(" not in plot.document()
    assert "<style>" not in plot.drawn()


def test_templates_and_style_are_in_the_wheel(tmp_path: Path) -> None:
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path))
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if name.endswith(PAGE_FILES)}
    files = [path for path in (ROOT / "rigwatch").rglob("*") if path.suffix in PAGE_FILES]
    assert packed == {str(path.relative_to(ROOT)) for path in files}
    assert "rigwatch/page/style.css" in packed
