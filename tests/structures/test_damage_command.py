"""`rigwatch structure damage` on tables and sessions, and the page that it writes."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.structures.records.record import read_record
from rigwatch.structures.records.session_record import read_any, record_of_session

KABE = Path(__file__).parents[2] / "configs" / "structures" / "kabe_antenna.toml"
NODES = range(1, 9)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("record") / "damaged.csv"
    damage = ["--damage", "5", "springs.k4_46.stiffness=50"]
    made = ["structure", "simulate", str(KABE), str(path), "--duration", "8", "--noise", "0.02"]
    assert main([*made, *damage]) == 0
    return path


@pytest.fixture(scope="module")
def session(table: Path) -> Path:
    path = table.with_suffix(".mcap")
    maps = [part for node in NODES for part in ("--map", f"x{node}=x{node}[m]")]
    assert main(["import", str(table), str(path), "--time", "t[s]", *maps]) == 0
    return path


def test_the_result_is_reported_as_json_alone(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "damage.html"
    code = main(["structure", "damage", str(KABE), str(table), "--report", str(page), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert code == 0
    (damage,) = told["damages"]
    assert damage["ranking"][0]["coefficient"] == "k4_46"
    assert damage["instant"] == pytest.approx(5.0, abs=0.05)
    assert damage["interval"][0] <= 5.0 <= damage["interval"][1]
    assert damage["parameters"]["k4_46"]["value"] == pytest.approx(50.0, rel=0.02)
    assert set(told["undamaged"]["noise"]) == {f"x{node}" for node in NODES}
    assert told["undamaged"]["noise_units"] == {f"x{node}": "m" for node in NODES}
    check_page(page.read_text(encoding="utf-8"))


def check_page(text: str) -> None:
    """It stands for itself: nothing is fetched, nothing runs, every drawing is whole."""
    assert "k4_46 softer at" in text
    assert not re.search(r"<script|<link|src=|@import|url\(", text)
    assert not re.search(r"https?://", text)
    drawings = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(drawings) == 3
    for drawing in drawings:
        assert "nan" not in drawing
        ElementTree.fromstring(drawing)


def test_a_session_is_the_same_record_as_its_table(table: Path, session: Path) -> None:
    of_table, of_session = read_any(table), read_any(session)
    assert of_session.dt == pytest.approx(of_table.dt)
    for name, column in of_table.columns.items():
        np.testing.assert_allclose(of_session.columns[name], column, rtol=0, atol=1e-12)


def test_a_session_is_examined_like_a_table(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["structure", "damage", str(KABE), str(session), "--known"]) == 0
    said = capsys.readouterr()
    assert re.search(r"happened at (4\.9|5\.0)", said.out)
    assert "most likely k4_46" in said.err


def test_invalid_samples_of_a_session_are_missing(table: Path, tmp_path: Path) -> None:
    record, holed, path = read_record(table), tmp_path / "holed.csv", tmp_path / "holed.mcap"
    lines = table.read_text(encoding="utf-8").splitlines()
    cells = lines[51].split(",")
    lines[51] = ",".join(["nan" if at == 3 else cell for at, cell in enumerate(cells)])
    holed.write_text("\n".join(lines) + "\n", encoding="utf-8")
    maps = [part for node in NODES for part in ("--map", f"x{node}=x{node}[m]")]
    made = ["import", str(holed), str(path), "--time", "t[s]", "--flag-missing", *maps]
    assert main(made) == 0
    found = record_of_session(path).columns["x3"]
    assert np.flatnonzero(np.isnan(found)).tolist() == [50]
    assert found[51] == pytest.approx(record.columns["x3"][51])


@pytest.mark.parametrize(
    ("record", "words"),
    [
        ("missing.mcap", "no such file or folder"),
        ("missing.csv", "missing.csv"),
    ],
)
def test_what_cannot_be_read_is_one_plain_line(
    record: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["structure", "damage", str(KABE), str(tmp_path / record)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_a_page_that_cannot_be_written_is_one_plain_line(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "no" / "page.html"
    arguments = ["structure", "damage", str(KABE), str(table), "--known", "--report", str(target)]
    assert main(arguments) == 2
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.nightly
def test_several_records_give_what_each_gives_alone(
    table: Path, session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = tmp_path / "whole.csv"
    assert main(["structure", "simulate", str(KABE), str(whole), "--duration", "4"]) == 0
    target = tmp_path / "damages.jsonl"
    given = [str(path) for path in (table, session, whole)]
    words = ["structure", "damage", str(KABE)]
    assert main([*words, *given, "--results", str(target)]) == 0
    assert "damaged.csv: at 4.9" in (told := capsys.readouterr().out)
    assert "k4_46" in told
    lines = {line["path"]: line["value"] for line in map(json.loads, target.open())}
    for path in given:
        assert main([*words, path, "--json"]) == 0
        alone = json.loads(capsys.readouterr().out)
        assert {name: lines[path][name] for name in alone} == alone
    assert main([*words, *given, "--report", str(tmp_path / "page.html")]) == 2
    assert "expected one" in capsys.readouterr().err
