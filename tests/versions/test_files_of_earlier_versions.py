"""Files that earlier versions have written are read by this one.

A folder a version, named by its day: what `rigwatch demo` of that version left behind, its session
cut to two seconds after friction was named, and its folder renamed to /var/lib/rig. `left.toml`
says what was read of the files when they were kept, `formats.toml` in which formats they are.
`python -m tools.keep_version` makes one, with a study of the two logs that one folder holds.
"""

import json
import re
import tomllib
from pathlib import Path
from typing import Annotated

import pytest
from msgspec import Meta, defstruct

from monitor.alarms import AlarmManager, read_journal
from rigwatch.archive import Store, query
from rigwatch.commands import main
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from tests.alarms.alarm_signals import newest
from tools.keep_version import formats
from tools.keep_version.keeping import CONSTANT, SENT, left_in

HERE = Path(__file__).parent
VERSIONS = sorted(path for path in HERE.iterdir() if (path / "session.mcap").is_file())
STUDIES = sorted(path.parent for path in HERE.glob("*/study/study.toml"))
INDEXED = sorted(path for path in HERE.iterdir() if (path / "rigwatch-index").is_dir())
ROOT = HERE.parents[1]
LAST_BEFORE_TOML = "2026-11-20"
"""The last whose recorder kept no positions."""


@pytest.fixture(params=VERSIONS, ids=lambda path: path.name)
def version(request: pytest.FixtureRequest) -> Path:
    return Path(request.param)


def test_every_released_version_has_kept_files() -> None:
    """A release comes with the files of its version: `python -m tools.keep_version`."""
    heads = re.findall(r"^## (\d\S*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    released = {f"rigwatch {version}" for version in (*heads, project["version"])}
    assert released <= {
        open_session(version / "session.mcap").info.software for version in VERSIONS
    }
    assert len(VERSIONS) >= 4


def test_files_of_the_present_formats_are_kept() -> None:
    newest = VERSIONS[-1]
    file = newest / formats.NAME
    kept = tomllib.loads(file.read_text("utf-8")) if file.exists() else {}
    changed = formats.changed(kept, formats.digests(CONSTANT))
    assert not changed, (
        f"the formats of {', '.join(changed)} are no longer those of {newest.relative_to(ROOT)}: "
        "run `python -m tools.keep_version` and commit the folder that it makes"
    )


def test_a_format_that_changes_is_told_and_words_are_no_format() -> None:
    def struct(description: str, **more: type) -> type:
        text = Annotated[str, Meta(description=description)]
        return defstruct("Format", [("name", text), *more.items()])

    before = formats.digest_of(struct("the name"))
    assert formats.digest_of(struct("what it is called")) == before
    assert formats.digest_of(struct("the name", unit=str)) != before
    kept = {"model": before, "study": "5"}
    assert formats.changed(kept, dict(kept)) == []
    assert formats.changed(kept, {"model": "6", "index": "7"}) == ["index", "model", "study"]


def test_what_was_read_of_the_files_then_is_read_of_them_now(version: Path) -> None:
    left = tomllib.loads((version / "left.toml").read_text("utf-8"))
    assert left_in(version) == left
    assert left["samples"] == left["estimates"] > 500
    assert left["friction"] != "normal"
    assert left["position"] >= 0
    assert ("recorded" in left) == (version.name > LAST_BEFORE_TOML)
    assert ("device" in left) == (version / formats.NAME).exists()
    assert ("sent" in left) == (version / SENT).exists()


def test_kept_files_are_small(version: Path) -> None:
    files = [path for path in version.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 250_000


def test_a_session_is_read_whole(version: Path) -> None:
    session = open_session(version / "session.mcap")
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


def test_a_journal_is_read_whole_and_its_alarms_stand(version: Path) -> None:
    records, unread = read_journal(version / "alarms.jsonl")
    assert unread == 0
    alarms = AlarmManager()
    alarms.restore(newest(records))
    assert "dry_friction" in {alarm.name for alarm in alarms.standing()}


@pytest.mark.parametrize("study", STUDIES, ids=lambda path: path.parent.name)
def test_a_study_shows_its_effects_and_its_steps(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "show", str(study)]) == 0
    shown = capsys.readouterr().out
    assert "coulomb@shaft" in shown
    steps = [line.split()[1] for line in shown.splitlines() if line.strip().startswith("2026-")]
    assert steps == ["new", "add"]


@pytest.mark.parametrize("version", INDEXED, ids=lambda path: path.name)
def test_an_index_of_an_archive_answers(version: Path) -> None:
    store = Store(str(version))
    ((rig, samples, raised),) = query(store, "select rig, samples, raised from sessions").rows
    assert (rig, samples) == ("demo", 588)
    assert "dry_friction" in raised
    names = {name for (name,) in query(store, "select distinct name from seconds").rows}
    assert {"theta1", "residual"} <= names
