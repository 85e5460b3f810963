"""An archive under kills, two writers at once, and in a folder with any name."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rigwatch.archive import Store, ask, index, query, retain
from rigwatch.archive.one_writer import one_writer
from rigwatch.batch import expand
from rigwatch.commands import main
from tests.archive.sessions import write_session
from tests.archive.test_thinning import NOW, OLD

TABLES = {
    "sessions": "select session, rig, status, remark, samples, missing from sessions order by 1",
    "losses": "select session, count, reason from losses order by 1",
    "alarms": "select session, name, state from alarms order by 1, 2",
    "seconds": "select rig, day, name, second, count, mean, low, high from seconds order by all",
}
CHANGES = ("os.rename", "os.remove", "os.rmdir", "os.mkdir")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Two old sessions, one of several files, which the index knows."""
    made = tmp_path / "archive"
    for number in range(3):
        name = f"{number + 1:06d}.mcap"
        write_session(made / "old" / name, start_s=4 * number, boot=number + 1, missing=3)
    (made / "old" / "positions.json").write_text("{}")
    write_session(made / "single.mcap", start_s=60, alarm="link")
    write_session(made / "new.mcap", start_s=99 * 86400)
    index(Store(str(made)))
    return made


def thin(root: Path) -> None:
    found = retain(Store(str(root)), OLD, now=NOW, remove=True, keep_seconds=True)
    assert found.failures == []


def told(root: Path) -> dict[str, Any]:
    """All that an archive knows, and the names of its files."""
    store = Store(str(root))
    rows = {name: query(store, sql).rows for name, sql in TABLES.items()}
    return rows | {"files": sorted(f"{path.relative_to(root)}" for path in root.rglob("*"))}


def killed_at(root: Path, change: int) -> bool:
    """Thin in a process that SIGKILL ends before its change of a file of this number."""
    child = os.fork()
    if child == 0:
        left = [change]

        def kill(event: str, arguments: tuple[Any, ...]) -> None:
            writes = event == "open" and (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR)
            if (event in CHANGES or writes) and str(arguments[0]).startswith(str(root)):
                left[0] -= 1
                if left[0] < 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(kill)
        thin(root)
        os._exit(0)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


@pytest.mark.parametrize(
    ("next_run", "every"),
    [
        ("retain", 3),
        pytest.param("retain", 1, marks=pytest.mark.nightly),
        pytest.param("index", 1, marks=pytest.mark.nightly),
    ],
)
def test_thinning_killed_at_any_point_loses_nothing(
    root: Path, tmp_path: Path, next_run: str, every: int
) -> None:
    whole = tmp_path / "whole"
    shutil.copytree(root, whole)
    thin(whole)
    expected, change = told(whole), 0
    while True:
        part = tmp_path / "part"
        shutil.copytree(root, part)
        if not killed_at(part, change):
            break
        if next_run == "index":
            index(Store(str(part)))
        thin(part)
        assert told(part) == expected, f"killed before change {change}"
        shutil.rmtree(part)
        change += every
    assert change > 12


def test_a_second_writer_is_refused(root: Path) -> None:
    store = Store(str(root))
    before = told(root)
    command = [sys.executable, "-m", "rigwatch", "archive"]
    with one_writer(store):
        for action in (["index"], ["retain", "--keep-days", "1", "--remove"]):
            words = [*command, action[0], str(root), *action[1:]]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            assert done.returncode == 2
            assert f"rigwatch: {root}: process {os.getpid()} writes its index" in done.stderr
    assert told(root) == before
    assert main(["archive", "index", str(root)]) == 0


@pytest.mark.parametrize("name", ["a [x] *%20#é ?b", "100% [0-9]", "q'uote \"", "rig=7", "**"])
def test_names_are_taken_literally(tmp_path: Path, name: str) -> None:
    root = tmp_path / name
    write_session(root / f"{name} s" / "000001.mcap")
    write_session(root / f"{name}.mcap", start_s=50)
    write_session(tmp_path / "a x  b" / "stranger.mcap", rig="stranger")
    index(Store(str(tmp_path / "a x  b")))
    assert main(["archive", "index", str(root)]) == 0
    store = Store(str(root))
    names = {f"{name} s", f"{name}.mcap"}
    found = query(store, "select session, rig from sessions").rows
    assert set(found) == {(one, "bench1") for one in names}
    assert query(store, "select rig, count(*) from seconds group by rig").rows == [("bench1", 8)]
    assert main(["archive", "show", str(root), f"{name}.mcap"]) == 0
    assert {Path(path).name for path in expand([root])} == names
    thin(root)
    assert sorted(path.name for path in root.iterdir()) == ["rigwatch-index"]


def test_an_underscore_in_the_name_of_a_rig_is_no_pattern(tmp_path: Path) -> None:
    write_session(tmp_path / "a.mcap", rig="a_b")
    write_session(tmp_path / "b.mcap", rig="a-b", start_s=9)
    index(Store(str(tmp_path)))
    rigs = {row[0] for row in ask(Store(str(tmp_path)), "rigs", rig="a_b").rows}
    assert rigs == {"a_b"}
    assert len(ask(Store(str(tmp_path)), "rigs", rig="a%").rows) == 2
