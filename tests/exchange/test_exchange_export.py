"""What is exported and imported again is the same, to the last bit."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from rigwatch.commands import main
from rigwatch.wire.errors import SessionError
from rigwatch.wire.exchange.exporting import export_session, variable_names
from rigwatch.wire.exchange.importing import import_file
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.messages import encode
from rigwatch.wire.messages.message_types import Column, EstimateBlock, SampleBlock
from rigwatch.wire.session import Session, SessionWriter, open_session, run_info

T0 = 1_700_000_000_123_456_789
FORMATS = [".csv", ".parquet", ".mat"]


def samples(seq: int, n: int, boot: int) -> SampleBlock:
    rng = np.random.default_rng(seq)
    index = np.arange(seq, seq + n)
    values = rng.normal(size=n) * 10.0 ** rng.integers(-300, 300, n)
    values[::7] = np.nan
    values[1::9] = -np.inf
    values[2::9] = -0.0
    flags = rng.integers(0, 64, n).astype(np.uint8)
    channels = (
        Column("voltage", "V", values, flags),
        Column("acceleration", "m/s^2", values[::-1].copy(), flags),
        Column("no quality", "", values * 1e-3),
    )
    return SampleBlock("rig", boot, seq, index * 3906 + 1, T0 + index * 3_906_251, channels)


def estimates(seq: int, n: int) -> EstimateBlock:
    values = np.random.default_rng(seq).normal(size=n)
    columns = (Column("theta1", "", values), Column("residual", "m/s^2", -values))
    return EstimateBlock("rig", 1 << 62, seq, T0 + np.arange(n), columns)


@pytest.fixture
def session(tmp_path: Path) -> Session:
    path = tmp_path / "a.mcap"
    with SessionWriter(path, run_info("bench1", 256.0)) as writer:
        for block in (samples(0, 700, 1 << 62), samples(800, 50, 1 << 62), samples(0, 9, 3)):
            writer.write(block)
        writer.write(estimates(5, 300))
    return open_session(path)


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("kind", ["samples", "estimates"])
def test_round_trip(tmp_path: Path, session: Session, ending: str, kind: str) -> None:
    target = tmp_path / f"a{ending}"
    export_session(session, target, estimates=kind == "estimates")
    again = open_session(import_file(target, tmp_path / "b.mcap", ImportMapping()).path)
    before = [encode(block) for block in getattr(session, kind)()]
    after = [encode(block) for block in getattr(again, kind)()]
    assert len(before) == (3 if kind == "samples" else 1)
    assert after == before


def test_titles_carry_units(tmp_path: Path, session: Session) -> None:
    export_session(session, tmp_path / "a.csv")
    head = (tmp_path / "a.csv").read_text().splitlines()[0]
    assert head == (
        "boot,seq,t_ns [ns],device_us [us],voltage [V],voltage quality,"
        "acceleration [m/s^2],acceleration quality,no quality []"
    )
    export_session(session, tmp_path / "a.mat")
    content = loadmat(tmp_path / "a.mat")
    titles = [str(cell[0]) for cell in content["column_titles"].ravel()]
    assert "acceleration=acceleration [m/s^2]" in titles
    assert content["acceleration"].shape == (759, 1)


def test_a_single_row_survives(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("b", 1.0)) as writer:
        writer.write(estimates(0, 1))
    session = open_session(tmp_path / "a.mcap")
    for ending in FORMATS:
        export_session(session, tmp_path / f"a{ending}", estimates=True)
        made = import_file(tmp_path / f"a{ending}", tmp_path / f"b{ending}.mcap", ImportMapping())
        (block,) = open_session(made.path).estimates()
        assert encode(block) == encode(estimates(0, 1))


def test_names_for_matlab_are_valid_and_different() -> None:
    titles = ["2nd [m]", "a b [m]", "a_b [m]", "x" * 40, "x" * 41, "t_ns [ns]"]
    names = variable_names(titles)
    assert len(set(names.values())) == len(titles)
    assert all(name.isidentifier() and len(name) <= 31 for name in names.values())


def test_what_cannot_be_exported_is_reported(tmp_path: Path, session: Session) -> None:
    with pytest.raises(SessionError, match=r"unknown format '\.xls', expected one of \.csv"):
        export_session(session, tmp_path / "a.xls")
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(SessionError, match="exists already"):
        export_session(session, tmp_path / "a.csv")
    with pytest.raises(SessionError, match="found no samples to export"):
        export_session(session, tmp_path / "b.csv", device="other")


def test_a_change_of_channels_is_refused(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("b", 256.0)) as writer:
        writer.write(samples(0, 5, 1))
        block = samples(5, 5, 1)
        writer.write(SampleBlock("rig", 1, 5, block.device_us, block.t_ns, block.channels[:1]))
    with pytest.raises(SessionError, match="the columns change at boot 1, seq 5"):
        export_session(open_session(tmp_path / "a.mcap"), tmp_path / "a.csv")
    assert not (tmp_path / "a.csv").exists()


def test_the_command_line(
    tmp_path: Path, session: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "part.csv"
    options = ["--start", "0", "--end", "0.1"]
    assert main(["export", str(session.path), str(target), *options]) == 0
    assert "rows of boot, seq" in capsys.readouterr().out
    rows = target.read_text().splitlines()[1:]
    assert 26 <= len(rows) <= 35
