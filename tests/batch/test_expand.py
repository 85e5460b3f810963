"""Paths, globs and folders as units."""

import os
from pathlib import Path

import pytest

from rigwatch.batch import expand, recording_at
from rigwatch.wire.errors import BatchError


def test_folders_hold_sessions_at_any_depth_and_segments_are_one(tmp_path):
    for name in ("a/one.mcap", "a/deep/two.mcap", "rig-1/000001.mcap", "rig-1/000002.mcap"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "a/notes.txt").touch()
    names = ["a/deep/two.mcap", "a/one.mcap", "rig-1"]
    assert expand([tmp_path]) == [str(tmp_path / name) for name in names]
    assert recording_at(tmp_path / "rig-1") == [tmp_path / "rig-1"]


def test_each_unit_is_there_once_in_order_of_names(tmp_path):
    for name in ("b.mcap", "a.mcap", "c.txt"):
        (tmp_path / name).touch()
    given = [tmp_path / "b.mcap", f"{tmp_path}/*.mcap", tmp_path, f"{tmp_path}/c.*"]
    names = ("a.mcap", "b.mcap", "c.txt")
    assert expand(given) == [str(tmp_path / name) for name in names]


def test_a_link_is_what_it_leads_to(tmp_path, monkeypatch):
    (tmp_path / "real").mkdir()
    (tmp_path / "real/a.mcap").touch()
    (tmp_path / "b.mcap").symlink_to(tmp_path / "real/a.mcap")
    (tmp_path / "other").symlink_to(tmp_path / "real")
    given = [tmp_path / name for name in ("real/a.mcap", "b.mcap", "other/a.mcap", "other")]
    assert expand(given) == [str(tmp_path / "real/a.mcap")]
    monkeypatch.chdir(tmp_path / "real")
    assert expand(["a.mcap", "../real/a.mcap", *given]) == ["a.mcap"]


def test_what_is_not_there_is_reported(tmp_path):
    with pytest.raises(BatchError, match="no such file or folder"):
        expand([tmp_path / "none.mcap"])
    with pytest.raises(BatchError, match="found nothing to work on"):
        expand([tmp_path, f"{tmp_path}/*.mcap"])


def test_a_name_that_no_file_of_results_can_hold_is_refused(tmp_path):
    Path(os.fsdecode(bytes(tmp_path) + b"/odd\xff.mcap")).touch()
    with pytest.raises(BatchError, match=r"odd\udcff.mcap: found a name that is not UTF-8"):
        expand([tmp_path])
