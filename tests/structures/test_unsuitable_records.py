"""Records that are damaged, or tell nothing: one plain line, and no value is made up."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.structures.damage.examination import Settings, examine
from rigwatch.structures.identification import kalman
from rigwatch.structures.identification.gauss_newton import solve
from rigwatch.structures.identification.identify import METHODS, identify
from rigwatch.structures.identification.problem import problem_of
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.records.record import Record, read_record, write_record
from rigwatch.wire.errors import ImportDataError, ModelError
from sim_plant.structure import simulate
from tests.structures.antenna import FILE, NAMES, antenna, record

TIME = np.arange(100) * 0.01


def test_a_truncated_archive_is_named(tmp_path: Path) -> None:
    path = tmp_path / "whole.npz"
    np.savez(path, t=TIME, x6=TIME)
    for size in (0, 2, 100, path.stat().st_size - 30):
        broken = tmp_path / "broken.npz"
        broken.write_bytes(path.read_bytes()[:size])
        with pytest.raises(ImportDataError, match=r"broken\.npz: found .*expected columns"):
            read_record(broken)


def test_an_archive_that_is_a_single_array_is_named(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    with path.open("wb") as stream:
        np.save(stream, TIME)
    with pytest.raises(ImportDataError, match="found one array without a name"):
        read_record(path)


def test_a_column_of_two_dimensions_is_named(tmp_path: Path) -> None:
    path = tmp_path / "wide.npz"
    np.savez(path, t=TIME, x6=np.zeros((100, 2)))
    with pytest.raises(ImportDataError, match=r"x6: found 100 x 2, expected a single column"):
        read_record(path)


def test_an_infinite_cell_is_a_missing_sample(tmp_path: Path) -> None:
    path = tmp_path / "record.npz"
    values = np.sin(TIME)
    values[7] = np.inf
    np.savez(path, t=TIME, x6=values)
    found = read_record(path).columns["x6"]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found)), [7])


@pytest.mark.parametrize("names", [("x6",), tuple(f"x{node}" for node in range(1, 9))])
@pytest.mark.parametrize("method", METHODS)
def test_a_record_at_rest_tells_nothing(method: str, names: tuple[str, ...]) -> None:
    still = Record(0.01, {name: np.zeros(100) for name in names})
    found = None
    with contextlib.suppress(ModelError):
        found = identify(method, antenna(), still, NAMES)
    assert found is None or not found.converged


@pytest.mark.parametrize("method", METHODS)
def test_a_channel_that_is_always_0_ends_no_method_in_a_traceback(method: str) -> None:
    columns = dict(record().columns)
    columns["x1"] = np.zeros_like(columns["x1"])
    found = identify(method, antenna(), Record(0.01, columns), NAMES)
    if method == "kalman":
        assert found.converged
        assert found.parameters["k4_46"] == pytest.approx(100.0, rel=1e-3)
        assert "x1 shows no noise, as it is always 0: left out" in found.remarks


def test_a_method_that_fails_does_not_take_the_others_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(kalman, "solve", fails)
    write_record(record(), tmp_path / "antenna.csv")
    assert main(["structure", "compare", str(FILE), str(tmp_path / "antenna.csv"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["kalman"]["error"].endswith("kalman cannot go on: Singular matrix")
    assert told["shooting"]["converged"]


def test_an_unknown_that_is_lost_on_the_way_is_refused_at_the_end() -> None:
    problem = problem_of(antenna(), Record(0.01, {"x6": np.zeros(100)}), NAMES)
    with pytest.raises(ModelError, match="does not determine k1_6_cubic"):
        solve(problem)


SOFTENING = """
name = "frame"
summary = "A mass on a spring that the file says softens much."
[nodes]
1.mass = 1.0
[springs]
ground = { between = ["1"], stiffness = 400.0 }
[dampers]
air = { between = ["1"], damping = 0.5 }
[loads.wind]
node = "1"
sines = [{ amplitude = 40.0, omega = 9.0 }]
"""


def test_a_model_that_diverges_is_no_undamaged_structure(tmp_path: Path) -> None:
    path = tmp_path / "frame.toml"
    path.write_text(SOFTENING, encoding="utf-8")
    made = simulate(path, 0.01, 6.0, damages=[])
    record = Record(0.01, {"x1": made.columns["x1"]})
    path.write_text(SOFTENING.replace("400.0", "400.0, cubic = -2e4"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"frame: the model diverges .* look at its cubic"):
        examine(load_structure(path), record, Settings(known=True, undamaged=0.3))
