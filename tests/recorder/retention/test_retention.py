"""Old recordings go by age and size; those with alarms stay longer, the present one always."""

import os
import tracemalloc
from pathlib import Path

from rigwatch.recorder import POSITIONS
from rigwatch.recorder.retention import DAY, Retention
from rigwatch.wire.messages import Alarm, Event
from rigwatch.wire.rig_config import RecorderSection
from rigwatch.wire.session import SessionWriter, run_info

NOW = 1_800_000_000.0


def segment(folder: Path, number: int, age_days: float, alarm: bool = False, closed: bool = True):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{number:06d}.mcap"
    writer = SessionWriter(path, run_info("bench", 256.0, t_ns=1))
    writer.write(Event("x", 1, "info", "FILLER", os.urandom(2000).hex()))
    if alarm:
        nan = float("nan")
        writer.write(
            Alarm(
                "link",
                "unacknowledged",
                "critical",
                "",
                "",
                "",
                0,
                0,
                2,
                nan,
                nan,
                nan,
                True,
                "",
                0,
            )
        )
    if closed:
        writer.close()
    else:
        writer.flush()
        writer.abandon()
    os.utime(path, (NOW - age_days * DAY,) * 2)
    return path


def rules(root: Path, **limits: float) -> Retention:
    return Retention(RecorderSection(folder=str(root), **limits), "bench")


def left(root: Path) -> set[str]:
    return {f"{path.parent.name}/{path.stem}" for path in root.glob("*/*.mcap")}


def test_age_alarms_and_other_rigs_decide_what_goes(tmp_path: Path) -> None:
    old, current = tmp_path / "bench-20260101T000000Z", tmp_path / "bench-20260301T000000Z"
    segment(old, 1, age_days=40)
    for name in POSITIONS:
        (old / name).write_text("{}")
    segment(current, 1, age_days=40)
    segment(current, 2, age_days=40, alarm=True)
    segment(current, 3, age_days=40, closed=False)
    segment(current, 4, age_days=10)
    segment(current, 5, age_days=40)
    others = {"other-20260101T000000Z", "bench-2-20260101T000000Z"}
    for folder in others:
        segment(tmp_path / folder, 1, age_days=400)
    kept = {f"{folder}/000001" for folder in others}
    retention = rules(tmp_path, keep_days=30, keep_alarm_days=90)
    (event,) = retention.update(0.0, int(NOW * 1e9), current)
    assert "2 segment(s) removed" in event.text
    assert not old.exists()
    name = current.name
    assert left(tmp_path) == {f"{name}/00000{n}" for n in (2, 3, 4, 5)} | kept
    assert retention.update(1.0, int(NOW * 1e9), current) == [], "not every second"
    later = int((NOW + 60 * DAY) * 1e9)
    retention.update(100.0, later, current)
    assert left(tmp_path) == {f"{name}/000005"} | kept


def test_above_the_size_limit_the_oldest_go_and_those_with_alarms_last(tmp_path: Path) -> None:
    current = tmp_path / "bench-20260301T000000Z"
    sizes = [
        segment(current, n, age_days=20 - n, alarm=n in (1, 3)).stat().st_size for n in range(1, 8)
    ]
    limit = (sizes[0] + sizes[2] + sizes[5] + sizes[6]) / 1e9
    rules(tmp_path, keep_gigabytes=limit * 1.001).update(0.0, int(NOW * 1e9), current)
    assert {path.stem for path in current.glob("*.mcap")} == {
        "000001", "000003", "000006", "000007"
    }  # fmt: skip


def test_without_limits_nothing_is_removed(tmp_path: Path) -> None:
    current = tmp_path / "bench-20260301T000000Z"
    segment(current, 1, age_days=4000)
    segment(current, 2, age_days=1)
    assert rules(tmp_path).update(0.0, int(NOW * 1e9), current) == []
    assert len(left(tmp_path)) == 2


def test_the_segment_being_written_counts_for_the_size(tmp_path: Path) -> None:
    current = tmp_path / "bench-20260301T000000Z"
    sizes = [segment(current, number, age_days=5 - number).stat().st_size for number in (1, 2, 3)]
    two = (sizes[1] + sizes[2] + sizes[0] // 2) / 1e9
    assert rules(tmp_path, keep_gigabytes=two).update(0.0, int(NOW * 1e9), current)
    assert left(tmp_path) == {f"{current.name}/{number:06d}" for number in (2, 3)}


def test_the_size_stays_within_its_limit_between_two_checks(tmp_path: Path) -> None:
    current = tmp_path / "bench-20260301T000000Z"
    size = segment(current, 0, age_days=1.0).stat().st_size
    retention = rules(tmp_path, keep_gigabytes=6.5 * size / 1e9)
    most = 0
    for minute in range(10):
        retention.update(60.0 * minute, int(NOW * 1e9), current)
        for number in (2 * minute + 1, 2 * minute + 2):
            segment(current, number, age_days=1.0 - number / 100.0)
        most = max(most, len(left(tmp_path)))
    assert most == 6
    for number in range(6):
        segment(tmp_path / "bench-20260101T000000Z", number, age_days=30.0)
    retention.update(600.0, int(NOW * 1e9), current)
    assert len(left(tmp_path)) == 4, "what was put there from elsewhere does not come again"


def test_what_others_remove_is_forgotten(tmp_path: Path) -> None:
    old, current = tmp_path / "bench-20260101T000000Z", tmp_path / "bench-20260301T000000Z"
    path = segment(old, 1, 1.0)
    segment(current, 1, 0.0)
    retention = rules(tmp_path, keep_days=400.0)
    assert retention.expired(NOW, current) == []
    assert retention._alarms == {str(old): {path.name: False}}
    path.unlink()
    assert retention.expired(NOW, current) == []
    assert not retention._alarms


def test_a_segment_that_is_kept_costs_little_memory(tmp_path: Path) -> None:
    current = tmp_path / "bench-20260301T000000Z"
    first = segment(current, 0, age_days=1.0)
    retention = rules(tmp_path, keep_gigabytes=1.0)
    count = 600
    for number in range(count):
        folder = tmp_path / f"bench-202602{1 + number // 30:02d}T000000Z"
        folder.mkdir(exist_ok=True)
        (folder / f"{number % 30:06d}.mcap").hardlink_to(first)
    retention.expired(NOW, current)
    tracemalloc.start()
    retention._alarms.clear()
    retention.expired(NOW, current)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    retention.expired(NOW, current)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 100 * count, "a year has thousands of them"
    assert most - kept < 150 * count, "what a look takes, the interpreter may never give back"
