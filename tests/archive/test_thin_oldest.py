"""A recorder's old sessions are thinned one at a time, and no kill loses any of them."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.archive import Store, query, thin_oldest
from rigwatch.commands import main
from tests.archive.sessions import DAY_S, EPOCH_S, write_session

NOW = datetime.fromtimestamp(EPOCH_S, UTC) + timedelta(days=100)
SEGMENTS = 12


def recorded(
    root: Path, day: int, *, rig: str = "bench1", segments: int = 1, **about: object
) -> Path:
    """A session of a day, with the file times of that day."""
    stamp = (datetime.fromtimestamp(EPOCH_S, UTC) + timedelta(days=day)).strftime("%Y%m%dT%H%M%SZ")
    folder = root / f"{rig}-{stamp}"
    for number in range(segments):
        path = folder / f"{number + 1:06}.mcap"
        start_s = day * DAY_S + 4.0 * number
        write_session(path, rig=rig, start_s=start_s, boot=number + 1, **about)  # type: ignore[arg-type]
        os.utime(path, (EPOCH_S + start_s,) * 2)
    return folder


def test_the_oldest_that_has_expired_goes_first_and_the_one_that_is_recorded_stays(
    tmp_path: Path,
) -> None:
    second, first = recorded(tmp_path, 2), recorded(tmp_path, 1)
    alarmed = recorded(tmp_path, 0, alarm="stiction")
    other = recorded(tmp_path, 0, rig="bench1-b")
    young, last = recorded(tmp_path, 80), recorded(tmp_path, 81)

    def thin(alarm_days: float = 0.0, days: float = 60.0) -> str:
        return thin_oldest(tmp_path, "bench1", days, alarm_days, now=NOW).session

    assert [thin(), thin(), thin()] == [first.name, second.name, ""]
    assert alarmed.exists()
    assert [thin(90.0), thin(90.0)] == [alarmed.name, ""]
    assert [thin(days=1.0), thin(days=1.0)] == [young.name, ""]
    assert [path.exists() for path in (first, second, alarmed, young)] == [False] * 4
    assert other.exists()
    assert last.exists()
    rows = query(Store(str(tmp_path)), "select session, status from sessions order by session").rows
    assert rows == sorted((one.name, "thinned") for one in (first, second, alarmed, young))


def test_one_that_was_cut_off_is_thinned_with_all_that_is_in_it(tmp_path: Path) -> None:
    cut = recorded(tmp_path, 0, close=False)
    recorded(tmp_path, 1)
    assert thin_oldest(tmp_path, "bench1", 60.0, 0.0, now=NOW).session == cut.name
    assert not cut.exists()
    assert figures(tmp_path) == [("samples.position", 64), ("theta1", 63)]


def figures(root: Path) -> list[tuple[str, int]]:
    """Number of values per name of which figures are kept."""
    sql = "select name, sum(count)::int from seconds group by name order by name"
    return query(Store(str(root)), sql).rows


def test_the_command_says_what_it_did(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old = recorded(tmp_path, 0)
    recorded(tmp_path, 1)
    words = ["archive", "thin", str(tmp_path), "--rig", "bench1", "--days", "1"]
    assert main([*words, "--json"]) == 0
    done = json.loads(capsys.readouterr().out)
    assert (done["session"], done["failures"]) == (old.name, [])
    assert main(words) == 0
    assert capsys.readouterr().out == "no session has expired\n"
    assert main([*words[:3], "--rig", "nobody", "--days", "1"]) == 2
    assert "nobody" in capsys.readouterr().err


@pytest.mark.nightly
def test_a_kill_at_any_point_loses_nothing(tmp_path: Path) -> None:
    old = recorded(tmp_path, 0, segments=SEGMENTS)
    recorded(tmp_path, 1)
    seconds, catalogue = tmp_path / "rigwatch-index", tmp_path / "rigwatch-index/sessions.parquet"
    points: list[Callable[[], bool]] = [
        lambda: any(seconds.rglob("*.parquet")),  # its figures are being stored
        catalogue.exists,  # it is in the catalogue
        lambda: any(seconds.rglob("*-samples.parquet")),  # the figures of its samples are stored
        lambda: len(segments(old)) < SEGMENTS,  # its recording goes
    ]
    killed = [kill_when(tmp_path, point, old) for point in points]
    assert killed[0], "no kill came before the end"
    words = [sys.executable, "-m", "rigwatch", "archive", "thin", str(tmp_path)]
    done = subprocess.run([*words, "--rig", "bench1", "--days", "1"], check=False)
    assert done.returncode == 0
    assert not old.exists()
    assert figures(tmp_path) == [("samples.position", 64 * SEGMENTS), ("theta1", 63 * SEGMENTS)]


def test_a_kill_before_the_empty_folder_goes_is_finished_by_the_next_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = recorded(tmp_path, 0)
    recorded(tmp_path, 1)
    rmdir = Path.rmdir

    def killed(folder: Path) -> None:
        if folder.name == old.name and not segments(old):
            raise KeyboardInterrupt
        rmdir(folder)

    monkeypatch.setattr(Path, "rmdir", killed)
    with pytest.raises(KeyboardInterrupt):
        thin_oldest(tmp_path, "bench1", 1.0, 0.0, now=NOW)
    monkeypatch.undo()
    assert list(old.iterdir()) == []
    assert thin_oldest(tmp_path, "bench1", 1.0, 0.0, now=NOW).session == ""
    assert not old.exists()
    assert figures(tmp_path) == [("samples.position", 64), ("theta1", 63)]


def segments(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.mcap"))


def kill_when(root: Path, point: Callable[[], bool], old: Path) -> bool:
    """Kill a thinning once `point` is reached, and judge what is left; False if it had ended."""
    words = [sys.executable, "-m", "rigwatch", "archive", "thin", str(root)]
    with subprocess.Popen([*words, "--rig", "bench1", "--days", "1"]) as process:
        while process.poll() is None and not point():
            time.sleep(0.0005)
        process.kill()
    whole = len(segments(old)) == SEGMENTS
    kept = (root / "rigwatch-index/sessions.parquet").exists() and (
        ("samples.position", 64 * SEGMENTS) in figures(root)
    )
    assert whole or kept, "neither the recording nor what stays of it is complete"
    return process.returncode == -signal.SIGKILL
