"""Old sessions of an archive go by the recorder's rules; what is not known to be old stays."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.archive import Store, index, query, retain
from rigwatch.commands import main
from rigwatch.recorder import POSITIONS
from rigwatch.wire.errors import ArchiveError
from rigwatch.wire.rig_config import RecorderSection
from tests.archive.sessions import DAY_S, EPOCH_S, write_session

NOW = datetime.fromtimestamp(EPOCH_S, UTC) + timedelta(days=100)


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Sessions of 100, 50 and 10 days ago, an old one with an alarm, one not closed, one broken."""
    root = tmp_path / "archive"
    write_session(root / "old" / "000001.mcap")
    write_session(root / "old" / "000002.mcap", start_s=4, boot=2)
    for name in POSITIONS:
        (root / "old" / name).write_text("{}")
    write_session(root / "alarmed.mcap", start_s=9, alarm="dry_friction")
    write_session(root / "middle.mcap", start_s=50 * DAY_S)
    write_session(root / "young.mcap", start_s=90 * DAY_S)
    write_session(root / "other.mcap", rig="b2", start_s=20)
    write_session(root / "open.mcap", rig="b2", start_s=30, close=False)
    (root / "broken.mcap").write_bytes(b"nonsense")
    index(Store(str(root)))
    return root


def _left(root: Path) -> set[str]:
    return {path.name for path in root.iterdir()} - {"rigwatch-index"}


def test_nothing_is_removed_unless_asked_for(archive):
    found = retain(Store(str(archive)), RecorderSection(keep_days=60), now=NOW)
    assert [one.session for one in found.expired] == ["other.mcap", "old"]
    assert found.removed == 0
    assert len(_left(archive)) == 7


def test_old_sessions_go_and_the_index_forgets_them(archive):
    store, rules = Store(str(archive)), RecorderSection(keep_days=60, keep_alarm_days=365)
    assert retain(store, rules, now=NOW, remove=True).removed == 2
    names = {"alarmed.mcap", "middle.mcap", "young.mcap", "open.mcap", "broken.mcap"}
    assert _left(archive) == names
    assert {name for (name,) in query(store, "select session from sessions").rows} == names
    assert query(store, "select count(*) from seconds where day < '2026-01-02'").rows != [(0,)]
    done = index(store)
    assert (done.read, done.removed) == (0, 0)


def test_alarms_make_a_session_stay_longer_but_not_for_ever(archive):
    rules = RecorderSection(keep_days=60, keep_alarm_days=80)
    found = retain(Store(str(archive)), rules, rig="bench1", now=NOW)
    assert [one.session for one in found.expired] == ["old", "alarmed.mcap"]


def test_the_oldest_go_until_the_rest_fits_those_with_alarms_last(archive):
    size = sum(path.stat().st_size for path in (archive / "old").iterdir())
    size += sum((archive / f"{name}.mcap").stat().st_size for name in ("alarmed", "middle"))
    rules = RecorderSection(keep_gigabytes=(size - 1) / 1e9)
    found = retain(Store(str(archive)), rules, rig="bench1", now=NOW)
    assert [one.session for one in found.expired] == ["old"]
    everything = RecorderSection(keep_gigabytes=1e-9)
    found = retain(Store(str(archive)), everything, rig="bench1", now=NOW)
    names = ["old", "middle.mcap", "young.mcap", "alarmed.mcap"]
    assert [one.session for one in found.expired] == names


def test_a_session_that_changed_since_the_index_stays(archive):
    with (archive / "other.mcap").open("ab") as file:
        file.write(b"more")
    write_session(archive / "new.mcap")
    found = retain(Store(str(archive)), RecorderSection(keep_days=1), now=NOW, remove=True)
    assert found.unknown == ["new.mcap", "other.mcap"]
    assert {"new.mcap", "other.mcap"} <= _left(archive)


def test_the_command_shows_and_then_removes(archive, capsys):
    assert main(["archive", "retain", str(archive), "--keep-days", "1"]) == 0
    shown = capsys.readouterr().out
    assert "4 of 7 sessions have expired" in shown
    words = ["--keep-days", "1", "--remove", "--json"]
    assert main(["archive", "retain", str(archive), *words]) == 0
    assert json.loads(capsys.readouterr().out)["removed"] == 4
    assert _left(archive) == {"alarmed.mcap", "open.mcap", "broken.mcap"}


def test_a_log_that_was_imported_without_a_date_stays_and_is_told(archive, capsys):
    source = archive.parent / "log.csv"
    source.write_text("t,u\n0,1\n1,2\n2,1\n")
    mapping = ["--time", "t[s]", "--map", "voltage=u[V]"]
    assert main(["import", str(source), str(archive / "log.mcap"), *mapping]) == 0
    index(Store(str(archive)))
    rules = RecorderSection(keep_days=1, keep_gigabytes=1e-9)
    found = retain(Store(str(archive)), rules, now=NOW, remove=True)
    assert found.undated == ["log.mcap"]
    assert "log.mcap" in _left(archive)
    assert main(["archive", "retain", str(archive), "--keep-days", "1"]) == 0
    assert "1 sessions stay that do not tell when they were recorded" in capsys.readouterr().out


def test_a_log_without_a_date_is_among_the_rigs(archive, capsys):
    source = archive.parent / "log.csv"
    source.write_text("t,u\n" + "".join(f"{k},{k % 2}\n" for k in range(40)))
    mapping = ["--time", "t[s]", "--map", "voltage=u[V]", "--rig", "undated"]
    assert main(["import", str(source), str(archive / "log.mcap"), *mapping]) == 0
    index(Store(str(archive)))
    capsys.readouterr()
    assert main(["archive", "query", str(archive), "rigs"]) == 0
    assert "undated" in capsys.readouterr().out


def test_without_a_limit_or_an_index_nothing_begins(tmp_path, capsys):
    assert main(["archive", "retain", str(tmp_path)]) == 2
    assert "expected --keep-days" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["archive", "retain", str(tmp_path), "--keep-days", "-1"])
    assert "--keep-days" in capsys.readouterr().err
    with pytest.raises(ArchiveError, match="has no index"):
        retain(Store(str(tmp_path)), RecorderSection(keep_days=1))
