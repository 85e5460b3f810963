import re
import xml.etree.ElementTree as Xml

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.structures.model.strain_energy import by_family, strain_energy
from rigwatch.structures.report.mode_drawing import shares_svg
from tests.structures.antenna import FILE, antenna


@pytest.fixture(scope="module")
def energy():
    return strain_energy(antenna())


def test_shares_of_a_mode_are_the_whole_and_energies_half_the_square_of_its_frequency(energy):
    np.testing.assert_allclose(energy.shares.sum(axis=1), 1.0)
    np.testing.assert_allclose(energy.energies.sum(axis=1), 0.5 * energy.omega**2)


def test_k1_carries_over_20_percent_in_six_modes_and_90_in_two(energy):
    families = energy.grouped(by_family(energy.springs))
    k1 = families.shares[:, families.springs.index("k1")]
    assert (k1 > 0.2).sum() == 6
    assert (k1 > 0.9).sum() == 2
    assert families.ranking()[0] == "k1"


def test_mass_six_leads_symmetric_with_mass_three(energy):
    part = {n: energy.shares[:, energy.springs.index(f"k1_{n}")] for n in (2, 3, 6, 7)}
    count = {n: int((share > 0.1).sum()) for n, share in part.items()}
    assert count[6] == count[3] > max(count[2], count[7])
    np.testing.assert_allclose(part[3], part[6], atol=0.02)


def test_the_figure_has_a_bar_for_every_spring_in_every_mode(energy):
    root = Xml.fromstring(shares_svg(energy, "a & b"))
    bars = [e for e in root.iter() if e.tag.endswith("title")]
    assert len(bars) == 8 * 14


def test_the_page_holds_both_figures_and_every_share(energy, tmp_path, capsys):
    target = tmp_path / "modes.html"
    assert main(["structure", "modes", str(FILE), "--report", str(target), "--json"]) == 0
    text = target.read_text(encoding="utf-8")
    drawings = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    bars = [re.findall(r"<title>mode \d, (\w+):", drawing) for drawing in drawings]
    assert [len(names) for names in bars] == [8 * 6, 8 * 4]
    assert set(bars[1]) == {"k1_2", "k1_3", "k1_6", "k1_7"}
    for drawing in drawings:
        Xml.fromstring(drawing)
    for name, shares in zip(energy.springs, energy.shares.T.tolist(), strict=True):
        for mode, share in enumerate(shares, start=1):
            assert f'<data value="{share!r}" data-name="{name}:{mode}">' in text
    assert not re.search(r"<script|<link|<img|@import|url\(", text)
