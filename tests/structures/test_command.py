import json
import re
from xml.etree import ElementTree

import pytest

from rigwatch.commands import main
from rigwatch.structures.identification.identify import METHODS
from rigwatch.structures.identification.problem import problem_of
from rigwatch.structures.records.record import read_record
from rigwatch.structures.report.identification_report import Findings, report_html
from rigwatch.wire.errors import ImportDataError
from tests.structures.antenna import FILE, FOLDER, TRUTH, antenna, record

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def csv(tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "antenna.csv"
    assert main(["structure", "simulate", str(FILE), str(path)]) == 0
    return path


def test_identify_prints_json(csv, capsys):
    assert main(["structure", "identify", str(FILE), str(csv), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    for name, value in TRUTH.items():
        assert printed["parameters"][name]["value"] == pytest.approx(value, rel=1e-4)


def test_a_session_is_identified_like_a_table(csv, tmp_path, capsys):
    session = tmp_path / "antenna.mcap"
    maps = [part for node in range(1, 9) for part in ("--map", f"x{node}=x{node}[m]")]
    assert main(["import", str(csv), str(session), "--time", "t[s]", *maps]) == 0
    capsys.readouterr()
    assert main(["structure", "identify", str(FILE), str(session), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    for name, value in TRUTH.items():
        assert printed["parameters"][name]["value"] == pytest.approx(value, rel=1e-4)


def test_compare_runs_every_method(csv, capsys):
    assert main(["structure", "compare", str(FILE), str(csv)]) == 0
    printed = capsys.readouterr().out
    for method in ("quasilinearization", "direct", "gauss-newton", "kalman", "shooting"):
        assert f"{method}: " in printed


def test_modes_are_ranked_and_drawn(tmp_path, capsys):
    svg = tmp_path / "shares.svg"
    assert main(["structure", "modes", str(FILE), "--families", "--svg", str(svg)]) == 0
    assert "most to suspect: k1, k3" in capsys.readouterr().out
    assert svg.read_text().startswith("<svg")


@pytest.mark.parametrize(
    ("extra", "expected"),
    [(["--unknown", "k1_6=x"], "found 'x', expected a number"),
     (["--unknown", "k1_66"], "found the unknown 'k1_66'"),
     (["--method", "magic"], "method: found 'magic'")],
)  # fmt: skip
def test_errors_are_one_plain_line(csv, extra, expected, capsys):
    assert main(["structure", "identify", str(FILE), str(csv), *extra]) == 2
    assert expected in capsys.readouterr().err


def test_a_frame_with_an_earthquake_goes_through(tmp_path, capsys):
    path, file = tmp_path / "frame.npz", FOLDER / "shear_frame.toml"
    arguments = [
        "structure",
        "simulate",
        str(file),
        str(path),
        "--duration",
        "15",
        "--noise",
        "0.01",
    ]
    assert main(arguments) == 0
    assert set(read_record(path).columns) == {"x_roof", "v_roof", "a_roof", "ground"}
    assert main(["structure", "identify", str(file), str(path)]) == 0


def test_a_record_with_uneven_time_is_refused(tmp_path):
    path = tmp_path / "uneven.csv"
    path.write_text("t,x6\n0,0\n0.01,1\n0.05,2\n")
    with pytest.raises(ImportDataError, match=r"found steps of 0\.01 to 0\.04 s"):
        read_record(path)


@pytest.mark.nightly
def test_compare_writes_a_page_of_every_method(csv, tmp_path, capsys):
    page = tmp_path / "antenna.html"
    assert main(["structure", "compare", str(FILE), str(csv), "--report", str(page), "--json"]) == 0
    told, text = json.loads(capsys.readouterr().out), page.read_text(encoding="utf-8")
    for method, result in told.items():
        for name, parameter in result["parameters"].items():
            value = re.escape(repr(parameter["value"]))
            assert re.search(rf'<data value="{value}" data-name="{method}:{name}">', text)
        assert f"{method}: unknowns after each iteration" in text
    shares = re.findall(r"</td><td class=\"num\">([\d.e-]+) %</td>", text)
    left = dict(zip(METHODS, map(float, shares), strict=True))
    assert left["shooting"] < 0.1
    assert left["gauss-newton"] > 50.0  # from this guess it settles elsewhere
    assert not re.search(r"https?://|<script|<link|<img|@import|url\(", text)
    drawings = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(drawings) == 1 + 2 * 8  # iterations; every position and what is left of it
    for drawing in drawings:
        assert "nan" not in drawing
        ElementTree.fromstring(drawing)


def test_compare_draws_every_method_for_the_viewer(csv, tmp_path):
    target = tmp_path / "methods.rrd"
    assert main(["structure", "compare", str(FILE), str(csv), "--save", str(target)]) == 0
    content = target.read_bytes()
    for method in METHODS:
        assert f"/x6/residual/{method}".encode() in content


def test_an_integrator_belongs_to_quasilinearization(csv, capsys):
    arguments = ["structure", "identify", str(FILE), str(csv), "--integrator", "runge-kutta"]
    assert main([*arguments, "--method", "quasilinearization"]) == 0
    assert main(arguments) == 2
    assert "found the method shooting, expected quasilinearization" in capsys.readouterr().err


def test_the_page_of_a_wrong_minimum_does_not_praise_it(csv, tmp_path):
    page, arguments = tmp_path / "antenna.html", ["structure", "identify", str(FILE), str(csv)]
    assert main([*arguments, "--method", "gauss-newton", "--report", str(page)]) == 1
    text = page.read_text(encoding="utf-8")
    assert "no method converged" in text
    assert "a wrong minimum: it settled where errors are" in text


def test_a_method_that_gave_nothing_says_why_on_the_page():
    problem = problem_of(antenna(), record(duration=2.0))
    text = report_html(Findings(problem, "antenna", {}, {"direct": "found <nothing>"}))
    assert "no method converged" in text
    assert "found &lt;nothing&gt;" in text
    ElementTree.fromstring(re.findall(r"<svg.*?</svg>", text, re.DOTALL)[0])


def test_a_page_that_cannot_be_written_is_one_plain_line(csv, tmp_path, capsys):
    target = tmp_path / "no" / "page.html"
    assert main(["structure", "identify", str(FILE), str(csv), "--report", str(target)]) == 2
    assert "cannot be written" in capsys.readouterr().err
