"""The index of an archive: what is read, what is said, what is stored."""

import os
import shutil
from datetime import datetime
from pathlib import Path

import numpy as np
import polars
import pytest

from rigwatch.archive import Store, index, show
from rigwatch.batch import executor_on
from rigwatch.wire.errors import ArchiveError
from tests.archive.sessions import DAY_S, RATE, theta1, write_session

CHUNK = b"\x04\x00\x00\x00zstd"
"""What stands before the compressed bytes of a chunk."""


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Two rigs; one session of segments, and one over midnight."""
    root = tmp_path / "archive"
    write_session(root / "a" / "000001.mcap", alarm="dry_friction", missing=5)
    write_session(root / "a" / "000002.mcap", start_s=4, boot=2)
    write_session(root / "b.mcap", rig="bench/2", start_s=DAY_S - 2, friction=3.0)
    return root


def _table(root: Path, name: str) -> polars.DataFrame:
    return polars.read_parquet(root / "rigwatch-index" / f"{name}.parquet")


def _files(root: Path) -> dict[str, bytes]:
    index_ = root / "rigwatch-index"
    return {str(f.relative_to(index_)): f.read_bytes() for f in index_.rglob("*.parquet")}


def test_a_row_per_session(archive):
    done = index(Store(str(archive)))
    assert (done.sessions, done.read, done.statuses) == (2, 2, {"ok": 2})
    first, second = _table(archive, "sessions").to_dicts()
    assert (first["session"], first["rig"], first["segments"]) == ("a", "bench1", 2)
    assert (first["samples"], first["missing"], first["gaps"]) == (8 * RATE, 5, 1)
    assert (first["restarts"], first["good"], first["raised"]) == (1, 1.0, ["dry_friction"])
    assert first["start"] == datetime(2026, 1, 1)
    assert second["rig"] == "bench/2"
    (alarm,) = _table(archive, "alarms").to_dicts()
    assert (alarm["name"], alarm["value"]) == ("dry_friction", 2.0), "the force told last"
    (loss,) = _table(archive, "losses").to_dicts()
    assert (loss["what"], loss["count"], loss["reason"]) == ("samples", 5, "line")


def test_figures_per_second_are_those_of_the_estimates(archive):
    index(Store(str(archive)))
    found = polars.read_parquet(archive / "rigwatch-index" / "seconds", hive_partitioning=True)
    mine = found.filter(polars.col("rig") == "bench/2").sort("second")
    seconds = theta1(3.0, 4 * RATE).reshape(4, RATE)
    assert mine["count"].to_list() == [RATE - 1, RATE, RATE, RATE]
    np.testing.assert_allclose(mine["mean"], np.nanmean(seconds, axis=1), rtol=1e-12)
    np.testing.assert_array_equal(mine["low"], np.nanmin(seconds, axis=1))
    np.testing.assert_array_equal(mine["high"], np.nanmax(seconds, axis=1))
    assert [str(day) for day in mine["day"]] == ["2026-01-01"] * 2 + ["2026-01-02"] * 2
    assert mine["unit"].to_list() == ["N"] * 4


def test_processes_write_the_same_bytes(archive, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(archive, other, copy_function=shutil.copy2)
    index(Store(str(archive)))
    with executor_on("local:2") as executor:
        index(Store(str(other)), executor=executor)
    found, others = _files(archive), _files(other)
    assert len(found) == 6
    assert {name: found[name] == others[name] for name in others} == dict.fromkeys(found, True)


def test_only_what_is_new_or_changed_is_read(archive):
    store = Store(str(archive))
    index(store)
    before = _files(archive)
    assert index(store).read == 0
    assert _files(archive) == before
    write_session(archive / "c.mcap", start_s=100, friction=7.0)
    (archive / "b.mcap").unlink()
    done = index(store)
    assert (done.sessions, done.read, done.removed) == (2, 1, 1)
    assert not list(archive.glob("rigwatch-index/seconds/*2*/*/*"))
    (archive / "c.mcap").unlink()
    write_session(archive / "c.mcap", start_s=100, friction=9.0)
    assert index(store).read == 1
    seconds = polars.read_parquet(archive / "rigwatch-index" / "seconds", hive_partitioning=True)
    assert seconds["high"].max() == pytest.approx(9.0 + 0.01 * (4 * RATE - 1))


def test_each_bad_session_has_a_sentence_and_the_rest_is_done(archive):
    whole = (archive / "b.mcap").read_bytes()
    (archive / "copy.mcap").write_bytes(whole)
    (archive / "foreign.mcap").write_bytes(b"no session at all")
    (archive / "empty.mcap").touch()
    os.mkfifo(archive / "pipe.mcap")
    middle = bytearray(whole)
    middle[whole.find(CHUNK, whole.find(CHUNK) + 1) + len(CHUNK) + 30] ^= 0xFF
    (archive / "hurt.mcap").write_bytes(middle)
    write_session(archive / "open.mcap", start_s=50, close=False)
    done = index(Store(str(archive)))
    expected = {"damaged": 1, "duplicate": 1, "failed": 1, "ok": 2, "unfinished": 1}
    expected["unreadable"] = 2
    assert done.statuses == expected
    said = dict(remark.split(": ", 1) for remark in done.remarks)
    assert said["copy.mcap"] == "is a copy of b.mcap"
    assert said["foreign.mcap"].startswith("holds no message of rigwatch: not an MCAP file")
    assert "empty.mcap" in said
    assert said["pipe.mcap"].endswith("is no file")
    assert "are damaged" in said["hurt.mcap"]
    assert "is not closed: still being recorded, or cut off" in said["open.mcap"]


def test_a_copy_takes_the_place_of_an_original_that_is_gone(archive):
    (archive / "copy.mcap").write_bytes((archive / "b.mcap").read_bytes())
    store = Store(str(archive))
    index(store)
    (archive / "b.mcap").unlink()
    assert index(store).statuses == {"ok": 2}
    assert show(store, "copy.mcap").session["status"] == "ok"
    assert len(list(archive.glob("rigwatch-index/seconds/*2*/*/*"))) == 2


def test_an_index_that_was_stopped_continues(archive):
    for number in range(4):
        write_session(archive / f"n{number}.mcap", start_s=100 * number + 100, boot=number)
    store = Store(str(archive))

    class StoppedError(Exception):
        pass

    def stop(text: str) -> None:
        if text.startswith("2 of 6"):
            raise StoppedError

    with pytest.raises(StoppedError):
        index(store, say=stop, batch=2)
    assert len(_table(archive, "sessions")) == 2
    done = index(store)
    assert (done.sessions, done.read) == (6, 4)


def test_what_is_no_archive_is_said(tmp_path):
    with pytest.raises(ArchiveError, match="no such folder"):
        index(Store(str(tmp_path / "none")))
    with pytest.raises(ArchiveError, match="has no index"):
        show(Store(str(tmp_path)))
    with pytest.raises(ArchiveError, match="expected a folder or an address"):
        Store("nothing://there")
