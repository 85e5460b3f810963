"""Files that earlier versions have written are read by this one.

A folder a version, named by its day: what `rigwatch demo` of that version left behind, its session
cut to the moment in which friction was named, and its folder renamed to /var/lib/rig. One has
a study of two logs, made and extended by that version, and its index of an archive.

Each generation of the formats has one: before messages were numbered (20); numbered, with positions
in JSON (22); with the operator's identity in the journal and positions in two halves (24).
"""

import json
from pathlib import Path
from shutil import copy

import pytest

from monitor.alarms import AlarmManager, read_journal
from monitor.process.cursor import Cursor
from rigwatch.archive import Store, query
from rigwatch.commands import main
from rigwatch.recorder.positions import load_positions
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from tests.alarms.alarm_signals import newest

HERE = Path(__file__).parent
VERSIONS = sorted(path for path in HERE.iterdir() if (path / "session.mcap").is_file())
LEFT_AT = {
    "2026-11-20": ("cleared_unacknowledged", 14535),
    "2026-11-22": ("cleared_unacknowledged", 16001),
    "2026-11-24": ("unacknowledged", 7561),
}
"""State of the friction alarm and number of the last sample, when the demo of a version ended."""


@pytest.fixture(params=VERSIONS, ids=lambda path: path.name)
def version(request: pytest.FixtureRequest) -> Path:
    return Path(request.param)


def test_there_are_versions() -> None:
    assert len(VERSIONS) >= 2


def test_a_session_is_read_whole(version: Path) -> None:
    session = open_session(version / "session.mcap")
    assert sum(map(len, session.samples())) == 588
    assert sum(map(len, session.estimates())) == 588
    names = [item.message.name for item in session.messages(["alarms"])]
    assert "dry_friction" in names
    assert session.info.rig == "demo"


def test_a_model_judges_a_session_of_its_time(
    version: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(version / "session.mcap"), "--model", str(version / "model.toml"), "--json"]
    assert main(["replay", *words]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["samples"] == 588
    assert "dry_friction" in [alarm["name"] for alarm in found["alarms"]]


def test_a_configuration_is_read_from_its_file_and_from_the_session(
    version: Path, tmp_path: Path
) -> None:
    config = load_rig(version / "rig.toml")
    recorded = tmp_path / "recorded.toml"
    recorded.write_text(open_session(version / "session.mcap").info.configuration)
    assert load_rig(recorded) == config
    assert config.recorder is not None
    assert config.recorder.folder == "/var/lib/rig/sessions"


def test_a_monitor_goes_on_from_journal_and_position(version: Path, tmp_path: Path) -> None:
    records, unread = read_journal(version / "alarms.jsonl")
    assert unread == 0
    alarms = AlarmManager()
    alarms.restore(newest(records))
    states = {alarm.name: alarm.state for alarm in alarms.standing()}
    state, seq = LEFT_AT[version.name]
    assert states["dry_friction"] == state
    stored = copy(version / "alarms.jsonl.position", tmp_path)  # a monitor maps its own
    position = Cursor(stored).read()
    assert position is not None
    assert position[1] == seq


@pytest.mark.parametrize(("version", "number"), [("2026-11-22", 13031), ("2026-11-24", 7181)])
def test_a_recorder_goes_on_from_its_positions(version: str, number: int) -> None:
    kept = load_positions(HERE / version)
    assert kept["estimates"]["monitor"][1] == number


def test_a_study_shows_its_effects_and_its_steps(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "show", str(HERE / "2026-11-23" / "study")]) == 0
    shown = capsys.readouterr().out
    assert "coulomb@shaft" in shown
    steps = [line.split()[1] for line in shown.splitlines() if line.strip().startswith("2026-")]
    assert steps == ["new", "add"]


def test_an_index_of_an_archive_answers() -> None:
    store = Store(str(HERE / "2026-11-23"))
    assert query(store, "select rig, samples, raised from sessions").rows == [
        ("demo", 588, ["dry_friction"])
    ]
    names = {name for (name,) in query(store, "select distinct name from seconds").rows}
    assert {"theta1", "residual"} <= names
