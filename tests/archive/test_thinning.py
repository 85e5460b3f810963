"""Thinned sessions: the recording goes, figures per second, alarms and losses stay."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from rigwatch.archive import Store, index, query, retain
from rigwatch.commands import main
from rigwatch.wire.errors import ArchiveError
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.messages.quality_flags import RESAMPLED, STALE
from rigwatch.wire.rig_config import RecorderSection
from rigwatch.wire.session import SessionWriter, run_info
from tests.archive.sessions import EPOCH_S, write_session

NOW = datetime.fromtimestamp(EPOCH_S, UTC) + timedelta(days=100)
OLD = RecorderSection(keep_days=60)
SECONDS = "select name, count, mean, low, high from seconds where name = '{}' order by second"


@pytest.fixture
def archive(tmp_path: Path) -> Store:
    """A session of two segments, with a loss, 100 days ago."""
    root = tmp_path / "archive"
    write_session(root / "old" / "000001.mcap", missing=3)
    write_session(root / "old" / "000002.mcap", start_s=4, boot=2)
    index(Store(str(root)))
    return Store(str(root))


def thinned(store: Store) -> None:
    found = retain(store, OLD, now=NOW, remove=True, keep_seconds=True)
    assert (found.removed, found.failures) == (1, [])


def test_figures_rows_and_losses_stay_when_the_recording_goes(archive: Store) -> None:
    before = {name: query(archive, sql).rows for name, sql in _questions().items()}
    thinned(archive)
    assert not Path(archive.url, "old").exists()
    after = {name: query(archive, sql).rows for name, sql in _questions().items()}
    assert after == before
    assert len(before["theta1"]) == 8
    assert before["losses"]
    assert query(archive, "select status from sessions").rows == [("thinned",)]
    position = query(archive, SECONDS.format("samples.position")).rows
    assert position == [("samples.position", 16, 1.0, 1.0, 1.0)] * 8
    assert query(archive, "select * from sessions where status not in ('ok', 'thinned')").rows == []


def _questions() -> dict[str, str]:
    losses = "select session, count, reason from losses"
    return {"theta1": SECONDS.format("theta1"), "losses": losses}


def test_the_next_index_and_the_next_retention_leave_it_as_it_is(archive: Store) -> None:
    thinned(archive)
    done = index(archive)
    assert (done.read, done.removed, done.statuses) == (0, 0, {"thinned": 1})
    assert retain(archive, OLD, now=NOW, remove=True, keep_seconds=True).expired == []
    assert len(query(archive, SECONDS.format("samples.position")).rows) == 8


def test_what_was_interrupted_before_the_files_went_is_finished(
    archive: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_store: Store, _name: str) -> None:
        raise ArchiveError("the store is read-only")

    with monkeypatch.context() as patch:
        patch.setattr(Store, "remove", refuse)
        found = retain(archive, OLD, now=NOW, remove=True, keep_seconds=True)
    assert found.removed == 0
    assert "read-only" in found.failures[0]
    thinned(archive)
    assert not Path(archive.url, "old").exists()
    assert len(query(archive, SECONDS.format("samples.position")).rows) == 8


def test_flagged_values_do_not_count(tmp_path: Path) -> None:
    t_ns = np.int64(EPOCH_S * 1e9) + np.arange(16) * 62_500_000
    values, quality = np.arange(16.0), np.zeros(16, np.uint8)
    values[5], quality[5] = 1e9, STALE
    quality[6:] = RESAMPLED  # a remark, not a defect
    column = (Column("position", "m", values, quality),)
    with SessionWriter(tmp_path / "a.mcap", run_info("b", 16.0, t_ns=int(t_ns[0]))) as writer:
        writer.write(SampleBlock("rig", 1, 0, t_ns // 1000, t_ns, column))
    store = Store(str(tmp_path))
    index(store)
    thinned(store)
    rows = query(store, SECONDS.format("samples.position")).rows
    assert rows == [("samples.position", 15, pytest.approx(115 / 15), 0.0, 15.0)]


def test_the_command_thins(archive: Store, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["archive", "retain", archive.url, "--keep-days", "1", "--keep-seconds", "--remove"]
    assert main(words) == 0
    assert "1 removed" in capsys.readouterr().out
    assert main(["archive", "show", archive.url]) == 0
    assert main(["archive", "show", archive.url, "old"]) == 0
    assert "thinned" in capsys.readouterr().out
