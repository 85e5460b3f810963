"""The sessions of a rig among those of hundreds: found at once, and listed only after a change."""

import os
from collections import Counter
from pathlib import Path

import pytest

from rigwatch.recorder import session_list, sessions_of
from rigwatch.wire import file_marks

FIRST, SECOND = "20260101T000000Z", "20260102T000000Z"


def names(root: Path, rig: str) -> list[str]:
    return sorted(path.name for path in sessions_of(root, rig))


def test_each_rig_has_its_own_sessions_whatever_its_id_is(tmp_path: Path) -> None:
    wanted = {
        "rig": [f"rig-{FIRST}", f"rig-{SECOND}", f"rig-{SECOND}-2"],
        "rig-2": [f"rig-2-{FIRST}"],
        f"rig-{FIRST}": [f"rig-{FIRST}-{SECOND}"],
        "other": [],
    }
    for found in wanted.values():
        for name in found:
            (tmp_path / name).mkdir()
    for name in ("rig-notes", f"{FIRST}", f"rig-{FIRST}.bak", "rig-2026-01-01"):
        (tmp_path / name).mkdir()
    assert {rig: names(tmp_path, rig) for rig in wanted} == wanted
    assert names(tmp_path / "nowhere", "rig") == []


def test_a_folder_is_listed_again_only_when_it_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listings = Counter[Path]()
    listed = os.listdir

    def counted(path: Path) -> list[str]:
        listings[path] += 1
        return listed(path)

    monkeypatch.setattr(session_list.os, "listdir", counted)
    (tmp_path / f"a-{FIRST}").mkdir()
    for _ in range(3):
        assert names(tmp_path, "a") == [f"a-{FIRST}"]
    assert listings[tmp_path] == 3, "it has changed just now: a further change may not show"
    monkeypatch.setattr(file_marks, "CERTAIN_AFTER_NS", 0)
    listings.clear()
    assert [names(tmp_path, rig) for rig in "aabb"] == [[f"a-{FIRST}"], [f"a-{FIRST}"], [], []]
    assert listings[tmp_path] == 1
    (tmp_path / f"b-{FIRST}").mkdir()
    (tmp_path / f"a-{FIRST}").rmdir()
    assert (names(tmp_path, "a"), names(tmp_path, "b")) == ([], [f"b-{FIRST}"])
    tmp_path.joinpath(f"b-{FIRST}").rmdir()
    tmp_path.rmdir()
    assert names(tmp_path, "b") == []
