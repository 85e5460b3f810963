"""Foreign recordings become sessions in SI units; what is wrong is named with its place."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from rigwatch.commands import main
from rigwatch.wire.errors import ImportDataError, RigwatchError
from rigwatch.wire.exchange.column_units import conversion
from rigwatch.wire.exchange.importing import Imported, import_file
from rigwatch.wire.exchange.mapping import ImportMapping, parse_source
from rigwatch.wire.exchange.mat5 import read_mat5
from rigwatch.wire.exchange.table_files import read_table
from rigwatch.wire.messages import encode
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.messages.message_types import SampleBlock
from rigwatch.wire.session import open_session
from rigwatch.wire.typed_files.loading import load
from rigwatch.wire.units.unit_table import ENTRIES

MAPPINGS = Path(__file__).parents[2] / "configs" / "imports"
GOOD = "t,qm,u\n0,1.0,5\n1,2.0,6\n2,3.0,7\n"


def measured(*parts: str) -> Path:
    """A file of the measured data sets."""
    root = os.environ.get("RIGWATCH_DATA")
    if root is None and os.environ.get("CI") != "true" and os.environ.get("CI") != "1":
        pytest.skip("RIGWATCH_DATA names no folder with the measured data sets")
    assert root is not None, "RIGWATCH_DATA is not set"
    return Path(root, *parts)


def made(tmp_path: Path, text: str, mapping: ImportMapping) -> tuple[SampleBlock, Imported]:
    """The one block of a session imported from CSV text."""
    source = tmp_path / "run.csv"
    source.write_text(text)
    result = import_file(source, tmp_path / "run.mcap", mapping)
    (block,) = open_session(result.path).samples(size=1 << 30)
    return block, result


def simple(**changes: object) -> ImportMapping:
    settings = {"channels": {"position": "qm[mm]"}, "time": "t[ms]"} | changes
    return ImportMapping(**settings)  # type: ignore[arg-type]


def test_columns_become_channels_in_si_units(tmp_path: Path) -> None:
    channels = {"position": "qm[mm]", "force": "u * 35.15065 - 2 [N]", "a": "u*-2[g0]"}
    block, result = made(tmp_path, GOOD, simple(channels=channels))
    assert [(c.name, c.unit) for c in block.channels] == [
        ("position", "m"),
        ("force", "N"),
        ("a", "m/s^2"),
    ]
    np.testing.assert_allclose(block.channel("position").values, [1e-3, 2e-3, 3e-3], rtol=1e-15)
    force = np.array([5, 6, 7]) * 35.15065 - 2
    np.testing.assert_allclose(block.channel("force").values, force, rtol=1e-15)
    np.testing.assert_allclose(block.channel("a").values[0], -10 * 9.80665, rtol=1e-15)
    assert result.rate_hz == 1000.0
    assert block.t_ns.tolist() == [0, 1_000_000, 2_000_000]
    assert not block.channel("force").quality.any()


def test_an_si_column_comes_over_bit_for_bit(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=500)
    text = "t,x\n" + "".join(f"{i / 256!r},{v!r}\n" for i, v in enumerate(values.tolist()))
    block, _ = made(tmp_path, text, simple(channels={"position": "x[m]"}, time="t[s]"))
    assert block.channel("position").values.tobytes() == values.tobytes()


@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        ("mm", "m", 1e-3),
        ("in", "m", 0.0254),
        ("bar", "Pa", 1e5),
        ("psi", "Pa", 6894.757293168361),
        ("g0", "m/s^2", 9.80665),
        ("ms", "s", 1e-3),
        ("V", "V", 1.0),
        ("lbf", "N", 4.4482216152605),
        ("rpm", "rad/s", np.pi / 30),
    ],
)
def test_units(unit: str, si: str, factor: float) -> None:
    found = conversion(unit, "anything")
    assert found.unit == si
    assert found.factor == pytest.approx(factor, rel=1e-14)


def test_every_unit_leads_to_an_si_unit_that_stays() -> None:
    for name in ENTRIES.keys() - {"g", "mg"}:
        found = conversion(conversion(name, "anything").unit, "anything")
        assert (found.factor, found.offset) == (1.0, 0.0)


def test_g_has_to_say_whether_it_is_gravity_or_the_gram() -> None:
    with pytest.raises(ImportDataError, match="'g', expected 'g0' for standard gravity or 'gram'"):
        conversion("g", "tower")
    assert conversion("gram", "load").factor == 1e-3


@pytest.mark.parametrize(
    ("text", "changes", "complaint"),
    [
        (GOOD, {"channels": {"position": "qn[mm]"}}, "run.csv: position: found no column 'qn'"),
        (
            GOOD,
            {"channels": {"position": "qm[mmm]"}},
            "unknown unit 'mmm', expected a known one: did you mean 'mm'?",
        ),
        (GOOD, {"channels": {"position": "qm[bar]"}}, "position: found the unit 'bar', expected"),
        (GOOD, {"channels": {"position": "qm"}}, "found 'qm', expected column[unit]"),
        (GOOD, {"channels": {"gap": "qm*2"}}, "or u*35.15[N], and [1] for what has no unit"),
        (GOOD, {"channels": {"force": "u*gtau[N]"}}, "force: found no scalar 'gtau'"),
        (GOOD, {"channels": {}}, "its columns are t, qm, u; expected --map 'CHANNEL=COLUMN"),
        (GOOD, {"time": "time[s]"}, "time: found no column 'time'"),
        (
            GOOD.replace("qm", "arm [g]"),
            {"channels": {"position": "arm [g0]"}},
            "found no column 'arm', expected 'arm [g]' with its own brackets, or one of t, arm [g]",
        ),
        (GOOD, {"time": "t[m]"}, "time: found the unit 'm', expected one of s, ms"),
        (GOOD, {"time": ""}, "found neither time nor rate"),
        (GOOD, {"rate": 1.0}, "found 1000 Hz in the time stamps, expected 1 Hz"),
        (GOOD, {"columns": ("t", "qm", "u")}, "run.csv:1, column t: found 't', expected a number"),
        (GOOD, {"skip_rows": 3}, "found no rows of data"),
        (GOOD, {"delimiter": "ab"}, "delimiter: found 'ab'"),
        (GOOD.replace("2.0", "two"), {}, "run.csv:3, column qm: found 'two', expected a number"),
        (GOOD.replace("2.0", ""), {}, "run.csv:3, column qm: found '', expected a number"),
        (GOOD.replace("2.0", "nan"), {}, "run.csv:3, column qm: found 'nan', expected a finite"),
        (GOOD.replace("3.0", "inf"), {}, "run.csv:4, column qm: found 'inf', expected a finite"),
        (GOOD.replace("2.0", "2,0"), {}, "run.csv:3: found 4 cells, expected 3"),
        (GOOD.replace("\n2,", "\n0,"), {}, "run.csv:4, column t: found 0 s after 0.001 s"),
        ("t,t,u\n0,1,2\n", {}, "found the columns ['t', 't', 'u'], expected different names"),
        ("", {}, "the file is empty"),
        ("t,qm,u\n", {}, "found no rows of data"),
    ],
)
def test_wrong_data_are_named_with_their_place(
    tmp_path: Path, text: str, changes: dict[str, object], complaint: str
) -> None:
    with pytest.raises(ImportDataError) as error:
        made(tmp_path, text, simple(**changes))
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "run.mcap").exists()


@pytest.mark.filterwarnings("error")
def test_a_value_too_large_for_si_is_flagged_without_a_word_of_numpy(tmp_path: Path) -> None:
    channels = {"position": "qm*1e10[m]"}
    block, _ = made(tmp_path, "t,qm\n0,1\n1,1e300\n2,3\n", simple(channels=channels))
    flags = block.channel("position").quality
    assert flags.tolist() == [quality.GOOD, quality.NON_FINITE, quality.GOOD]


def test_missing_values_can_be_flagged_instead(tmp_path: Path) -> None:
    text = GOOD.replace("2.0", "")
    block, _ = made(tmp_path, text, simple(flag_missing=True))
    flags = block.channel("position").quality
    assert flags.tolist() == [quality.GOOD, quality.NON_FINITE, quality.GOOD]
    assert np.isnan(block.channel("position").values[1])


def test_jittered_samples_are_resampled_and_said_so(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(10 + rng.choice([0, 0, 0, 1, 4], size=600)).astype(float)
    times[300:] += 500
    text = "t,qm,u\n" + "".join(f"{t},{3 * t},0\n" for t in times)
    block, result = made(tmp_path, text, simple(rate=100.0))
    assert set(np.diff(block.t_ns)) == {10_000_000}
    column = block.channel("position")
    np.testing.assert_allclose(column.values, 3e-3 * block.t_ns / 1e6, rtol=1e-9)
    assert (column.quality & quality.RESAMPLED).all()
    in_hole = (block.t_ns > times[299] * 1e6) & (block.t_ns < times[300] * 1e6)
    assert in_hole.sum() > 40
    assert ((column.quality & quality.STALE > 0) == in_hole).all()
    assert (quality.valid(column.quality) == ~in_hole).all()
    notes = open_session(result.path).info.notes
    assert "600 samples resampled to" in notes
    assert "at 100 Hz by linear interpolation" in notes
    assert f"{in_hole.sum()} samples in holes are flagged stale" in notes


@settings(max_examples=60, deadline=None)
@given(st.integers(21, 200), st.floats(1.0, 5000.0), st.floats(0, 0.04), st.integers(0, 9))
def test_nearly_uniform_times_stay_as_they_are(
    count: int, rate: float, jitter: float, seed: int
) -> None:
    from rigwatch.wire.exchange.grid import fit_grid

    noise = np.random.default_rng(seed).uniform(-jitter, jitter, count)
    times = (np.arange(count) + noise) / rate
    grid = fit_grid(times, None, 10.0)
    assert not grid.jittered
    assert grid.times is times
    assert grid.rate_hz == pytest.approx(rate, rel=0.01)


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
@pytest.mark.parametrize("since", [np.timedelta64(5, "s"), np.datetime64("2026-11-23T10:00:00")])
def test_dates_and_durations_are_seconds_by_their_own_resolution(
    tmp_path: Path, unit: str, since: np.timedelta64 | np.datetime64
) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    kind = f"{'timedelta64' if isinstance(since, np.timedelta64) else 'datetime64'}[{unit}]"
    steps = (np.arange(50) * 4).astype("timedelta64[ms]")
    table = pyarrow.table({"time": (since + steps).astype(kind), "x": np.arange(50.0)})
    parquet.write_table(table, tmp_path / "run.parquet")
    source, channels = tmp_path / "run.parquet", {"x": "x[m]"}
    mapping = ImportMapping(time="time[s]", channels=channels)
    assert import_file(source, tmp_path / "a.mcap", mapping).rate_hz == pytest.approx(250.0)
    wrong = ImportMapping(time=f"time[{unit}]", channels=channels)
    with pytest.raises(ImportDataError, match="dates or durations, which state their own"):
        import_file(source, tmp_path / "b.mcap", wrong)


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"data": np.zeros((9, 3))}, "found data of 9 x 3, expected a variable for each column"),
        ({"log": {"t": np.zeros(9)}}, "found no array of numbers.* structures are not read"),
    ],
)
def test_a_mat_file_without_columns_says_what_it_has(
    tmp_path: Path, variables: dict[str, object], said: str
) -> None:
    savemat(tmp_path / "a.mat", variables)
    with pytest.raises(ImportDataError, match=said):
        read_table(tmp_path / "a.mat", ImportMapping())


def test_matlab_files_of_hdf5_are_refused_with_the_way_out(tmp_path: Path) -> None:
    path = tmp_path / "new.mat"
    path.write_bytes(
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + bytes(600)
    )
    with pytest.raises(ImportDataError, match=r"new\.mat: found a MATLAB v7\.3 file .* '-v7'"):
        import_file(path, tmp_path / "x.mcap", simple())


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_mat_files_give_one_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("mat")
    savemat(folder / "a.mat", {"t": np.arange(9.0), "qm": np.arange(9.0), "k": 3.0})
    content = bytearray((folder / "a.mat").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    (folder / "b.mat").write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        import_file(folder / "b.mat", folder / "b.mcap", simple())
    except RigwatchError as error:
        line = str(error)
        assert "\n" not in line, line


def test_mat_files_are_read_as_scipy_reads_them(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    variables = {
        "a": rng.normal(size=(7, 3)),
        "b": rng.integers(-9, 9, (1, 5)).astype(np.int16),
        "c": np.float32(rng.normal(size=(4, 1))),
        "whole": np.array([[1.0, 2.0, 3.0]]),
        "n": np.array([[2**62]]),
        "flag": np.array([[True]]),
        "text": "°C and more",
        "texts": np.array(["one", "two words"], dtype=object),
        "z": np.array([[1 + 2j]]),
        "s": {"inner": 3},
    }
    for packed in (False, True):
        savemat(tmp_path / "a.mat", variables, do_compression=packed)
        found = read_mat5((tmp_path / "a.mat").read_bytes())
        expected = loadmat(tmp_path / "a.mat")
        assert set(found) == set(variables) - {"z", "s"}
        assert found["text"] == "°C and more"
        assert found["texts"] == ["one", "two words"]
        for name in ("a", "b", "c", "whole", "n", "flag"):
            np.testing.assert_array_equal(found[name], expected[name])


def test_sources_are_read_as_people_write_them() -> None:
    columns = ("vir", "a*b", "x-2", "x", "Position (mm)")
    assert parse_source("f", "vir*35.15065[N]", columns).factor == 35.15065
    assert parse_source("f", "vir * gtau [N]", columns).factor == "gtau"
    assert parse_source("f", "vir*1e3-2.5[N]", columns).offset == -2.5
    assert parse_source("f", "a*b[N]", columns).column == "a*b"
    assert parse_source("f", "x-2[N]", columns).column == "x-2"
    assert parse_source("f", "x-3[N]", columns).offset == -3
    assert parse_source("f", "Position (mm)[mm]", columns).column == "Position (mm)"


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run.csv").write_text(GOOD)
    target = str(tmp_path / "run.mcap")
    options = ["--map", "position=qm[mm]", "--time", "t[ms]", "--start", "2026-05-01T12:00:00"]
    assert main(["import", str(tmp_path / "run.csv"), target, *options]) == 0
    assert "3 samples at 1000 Hz of position [m]" in capsys.readouterr().out
    (block,) = open_session(target).samples()
    assert block.t_ns[0] == 1777636800 * 10**9
    assert main(["import", str(tmp_path / "run.csv"), target, *options]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["import", str(tmp_path / "run.csv"), target, "--map", "nonsense"]) == 2
    assert "--map: found 'nonsense'" in capsys.readouterr().err


def test_without_pyarrow_parquet_names_the_extra(tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['pyarrow'] = None\n"
        "from rigwatch.commands import main\n"
        f"sys.exit(main(['import', {str(tmp_path / 'a.parquet')!r}, 'x.mcap']))"
    )
    (tmp_path / "a.parquet").write_bytes(b"PAR1")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "install it with pip install 'rigwatch[parquet]'" in done.stderr


def test_emps(tmp_path: Path) -> None:
    source = measured("emps", "DATA_EMPS.mat")
    result = import_file(source, tmp_path / "a.mcap", load(MAPPINGS / "emps.toml", ImportMapping))
    (block,) = open_session(result.path).samples(size=1 << 30)
    raw = loadmat(source)
    assert len(block) == 24841
    assert result.rate_hz == 1000.0
    assert block.channel("position").values.tobytes() == raw["qm"].ravel().tobytes()
    force = raw["vir"].ravel() * raw["gtau"].item()
    np.testing.assert_array_equal(block.channel("force").values, force)


def test_emps_pulses(tmp_path: Path) -> None:
    source = measured("emps", "DATA_EMPS_PULSES.mat")
    mapping = load(MAPPINGS / "emps_pulses.toml", ImportMapping)
    (block,) = open_session(import_file(source, tmp_path / "a.mcap", mapping).path).samples(
        size=1 << 30
    )
    assert block.channel("pulses").unit == "N"


@pytest.mark.parametrize("name", ["SNLS80mV.mat", "Schroeder80mV.mat"])
def test_silverbox(tmp_path: Path, name: str) -> None:
    mapping = load(MAPPINGS / "silverbox.toml", ImportMapping)
    result = import_file(measured("silverbox", name), tmp_path / "a.mcap", mapping)
    assert (result.samples, result.rate_hz) == (131072, 610.3515625)
    assert open_session(result.path).info.sample_rate_hz == 1e7 / 2**14


@pytest.mark.parametrize(("bar", "pressure"), [(1, 1e5), (5, 5e5), (7, 7e5)])
def test_pneumatic_cylinder(tmp_path: Path, bar: int, pressure: float) -> None:
    source = measured("pneumatic_cylinder", f"O-ring257_{bar}bar.csv")
    mapping = load(MAPPINGS / "pneumatic_cylinder.toml", ImportMapping)
    result = import_file(source, tmp_path / "a.mcap", mapping)
    (block,) = open_session(result.path).samples(size=1 << 30)
    assert set(np.diff(block.t_ns)) == {10_000_000}
    assert block.channel("pressure").values.mean() == pytest.approx(pressure, rel=0.1)
    assert (block.channel("force").quality & quality.RESAMPLED).all()
    raw = np.loadtxt(source)[15:]
    position = np.interp(block.t_ns / 1e6, raw[:, 0], raw[:, 4]) * 1e-3
    np.testing.assert_allclose(block.channel("position").values, position, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        '{"t": [0, 1, 2], "qm": [1.0, 2.0, 3.0], "gain": 2, "rig": {"name": "a"}}',
        '[{"t": 0, "qm": 1.0}, {"t": 1, "qm": 2.0}, {"t": 2, "qm": 3.0}]',
        '{"kp": 8, "log": [{"t": 0, "qm": 1.0}, {"t": 1, "qm": 2.0}, {"t": 2, "qm": 3.0}]}',
        '{"kp": 8, "log": {"t": [0, 1, 2], "qm": [1.0, 2.0, 3.0]}}',
    ],
)
def test_json_of_columns_or_of_rows_is_read(tmp_path: Path, text: str) -> None:
    source = tmp_path / "run.json"
    source.write_text(text)
    import_file(source, tmp_path / "run.mcap", simple())
    (block,) = open_session(tmp_path / "run.mcap").samples(size=1 << 30)
    np.testing.assert_allclose(block.channel("position").values, [1e-3, 2e-3, 3e-3], rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"t": [0, 1', "run.json: not readable as JSON"),
        ("3", "run.json: found no table"),
        ('{"a": [{"t": 0}], "b": [{"t": 1}]}', "run.json: found the tables a, b, expected one"),
        ('{"a":' * 10_000 + "1" + "}" * 10_000, "run.json: not readable as JSON"),
        ('{"t": [0, 1], "qm": [1, null]}', "run.json, row 2, column qm: found 'nan'"),
    ],
)
def test_json_that_is_no_table_is_reported(tmp_path: Path, text: str, message: str) -> None:
    source = tmp_path / "run.json"
    source.write_text(text)
    with pytest.raises(ImportDataError, match=message):
        import_file(source, tmp_path / "run.mcap", simple())


def test_json_with_a_name_that_is_no_text_is_reported(tmp_path: Path) -> None:
    source = tmp_path / "run.json"
    source.write_bytes(b'{"\xf4": [0.0, 4.0], "qm": [1, 2]}')
    with pytest.raises(ImportDataError, match=r"run\.json: not readable as JSON"):
        import_file(source, tmp_path / "run.mcap", simple())


def test_several_files_become_sessions_of_a_folder(tmp_path, capsys):
    logs, target = tmp_path / "logs", tmp_path / "sessions"
    (logs / "more").mkdir(parents=True)
    target.mkdir()
    for name in ("a.csv", "more/b.csv"):
        (logs / name).write_text(GOOD)
    (logs / "bad.csv").write_text("t,other\n0,1\n")
    options = ["--time", "t[ms]", "--map", "position=qm[mm]"]
    words = ["import", str(logs), str(target), *options]
    assert main([*words, "--results", str(tmp_path / "made.jsonl")]) == 1
    out, err = capsys.readouterr()
    assert f"a.csv: {target}/a.mcap: 3 samples at 1000 Hz of position [m]" in out
    assert "2 done, 1 failed: 1 ImportDataError" in err
    assert sorted(path.name for path in target.iterdir()) == ["a.mcap", "b.mcap"]
    alone = tmp_path / "alone.mcap"
    assert main(["import", str(logs / "a.csv"), str(alone), *options]) == 0
    (one,), (other,) = (open_session(p).samples(size=99) for p in (alone, target / "a.mcap"))
    assert encode(one) == encode(other)


def test_files_that_would_become_one_session_are_refused(tmp_path, capsys):
    for folder in ("x", "y"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "run.csv").write_text(GOOD)
    given = [str(tmp_path / folder / "run.csv") for folder in ("x", "y")]
    assert main(["import", *given, str(tmp_path)]) == 2
    assert f"both become {tmp_path}/run.mcap" in capsys.readouterr().err
    assert main(["import", *given, str(tmp_path / "none")]) == 2
    assert "found no such folder" in capsys.readouterr().err


def test_a_record_written_twice_counts_once(tmp_path: Path) -> None:
    text = "t,qm,u\n0,1.0,5\n1,2.0,6\n1,2.0,6\n2,3.0,7\n3,4.0,8\n"
    block, result = made(tmp_path, text, simple())
    np.testing.assert_allclose(block.channels[0].values, [1e-3, 2e-3, 3e-3, 4e-3])
    assert "1 rows repeat the row before and count once" in result.remarks


def test_a_clock_coarser_than_the_samples_is_spread(tmp_path: Path) -> None:
    rows = "".join(f"{10 * (k // 2)},{k}.0,0\n" for k in range(8))
    block, result = made(tmp_path, "t,qm,u\n" + rows, simple())
    assert result.rate_hz == pytest.approx(200.0)
    np.testing.assert_allclose(block.channels[0].values, 1e-3 * np.arange(8))
    assert "4 rows with the time of the row before are spread to the next" in result.remarks


def test_time_that_stands_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ImportDataError, match=r"found 0\.005 s in every row"):
        made(tmp_path, "t,qm,u\n5,1,5\n5,2,6\n5,3,7\n", simple())


def test_only_the_missing_rows_of_a_uniform_recording_are_resampled(tmp_path: Path) -> None:
    kept = [k for k in range(100) if k not in {40, 41, 70}]
    text = "t,qm,u\n" + "".join(f"{10 * k},{k},0\n" for k in kept)
    block, _ = made(tmp_path, text, simple())
    marks = block.channel("position").quality
    assert np.flatnonzero(marks == quality.RESAMPLED).tolist() == [40, 41, 70]
    assert set(marks[kept]) == {quality.GOOD}


def test_the_rate_beside_a_jump_of_the_clock_is_that_of_the_samples(tmp_path: Path) -> None:
    """Steps of 1/256 s, written to the microsecond, are 3906 µs or 3907 µs."""
    from rigwatch.wire.exchange.grid import fit_grid

    at = np.arange(2048) / 256 + np.where(np.arange(2048) > 1000, 5.0, 0.0)
    grid = fit_grid(np.round(at, 6), None, 2.0)

    assert grid.rate_hz == 256.0
    assert grid.own.sum() == 2048
    assert grid.in_hole.sum() == 5 * 256


def test_steps_of_two_lengths_lose_no_sample(tmp_path: Path) -> None:
    """No step is near the median of a log whose steps alternate between short and long ones."""
    times = np.cumsum([0.0] + [1.0, 5.0] * 10)
    file = tmp_path / "log.csv"
    file.write_text("t,x\n" + "".join(f"{t},{2 * t}\n" for t in times))
    mapping = ImportMapping(channels={"position": "x[m]"}, time="t[s]")
    made = import_file(file, tmp_path / "log.mcap", mapping)
    assert (made.rate_hz, made.samples) == (1.0, 61)
    column = next(open_session(made.path).samples()).channel("position")
    assert np.allclose(column.values, 2 * np.arange(61))


@pytest.mark.parametrize(
    ("text", "mapping"),
    [
        ('{"t": [], "x": [1, 2]}', ImportMapping(channels={"position": "x[m]"}, time="t[s]")),
        ('{"x": [], "y": [1, 2]}', ImportMapping(channels={"position": "x[m]"}, rate=1.0)),
    ],
)
def test_a_column_without_values_is_named(
    tmp_path: Path, text: str, mapping: ImportMapping
) -> None:
    (tmp_path / "log.json").write_text(text)
    with pytest.raises(ImportDataError, match=r"found no values in '[tx]', expected at least one"):
        import_file(tmp_path / "log.json", tmp_path / "log.mcap", mapping)


def test_a_number_of_hundreds_of_digits_is_no_value(tmp_path: Path) -> None:
    file, digits = tmp_path / "log.json", "1" + "0" * 400
    file.write_text(f'{{"t": [0, 1, 2], "x": [1, 2, 3], "y": [1, {digits}, 3], "id": {digits}}}')
    known = ImportMapping(channels={"position": "x[m]"}, time="t[s]")
    assert import_file(file, tmp_path / "log.mcap", known).samples == 3
    wrong = ImportMapping(channels={"position": "y[m]"}, time="t[s]")
    with pytest.raises(
        ImportDataError, match=r"row 2, column y: found .* expected a finite number"
    ):
        import_file(file, tmp_path / "other.mcap", wrong)
