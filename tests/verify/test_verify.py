"""The monitor over the recordings of this folder: as the references say, however it is cut."""

import json
import shutil
from functools import cache
from pathlib import Path

import pytest

from monitor.model.model_file import load_model
from monitor.pipeline.rig_monitor import RigMonitor
from rigwatch.commands import main
from rigwatch.replay.cases import Case, load_cases, replayed
from rigwatch.replay.reference import Output
from rigwatch.wire.messages.blocks import pieces
from rigwatch.wire.messages.message_types import Alarm
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.session import SessionWriter, open_session

HERE = Path(__file__).parent
CASES = HERE / "cases.toml"
NAMES = ["friction", "stiction", "detectors", "troubled"]


def case(name: str) -> Case:
    return next(item for item in load_cases(CASES) if item.name == name)


@cache
def whole(name: str) -> tuple[bytes, ...]:
    """Everything published where the whole recording is one block."""
    return as_bytes(output(name, 1 << 30))


def output(name: str, block: int) -> Output:
    found = case(name)
    return replayed(found, HERE, open_session(HERE / found.recording), block)


def as_bytes(found: Output) -> tuple[bytes, ...]:
    return tuple(map(encode, (*found.blocks, *found.announcements)))


def test_every_field_is_as_in_the_references(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["verify", str(CASES), "--json"])
    verdicts = json.loads(capsys.readouterr().out)
    assert [verdict["differences"] for verdict in verdicts] == [[]] * len(NAMES)
    assert [verdict["name"] for verdict in verdicts] == NAMES
    assert all(verdict["fields"] > 50 and verdict["samples"] > 2000 for verdict in verdicts)
    assert code == 0


@pytest.mark.parametrize(
    ("name", "block"),
    [
        ("friction", 8),
        ("stiction", 3),
        pytest.param("detectors", 1, marks=pytest.mark.nightly),
        ("detectors", 64),
        *(("troubled", size) for size in (1, 3, 8, 4096)),
    ],
)
def test_the_cut_into_blocks_changes_no_bit(name: str, block: int) -> None:
    assert as_bytes(output(name, block)) == whole(name)


def test_the_cases_see_what_they_are_there_for() -> None:
    raised = {
        name: [a.name for a in output(name, 1 << 30).announcements if isinstance(a, Alarm)]
        for name in ("friction", "stiction", "troubled")
    }
    assert "dry_friction" in raised["friction"]
    assert "stiction" in raised["stiction"]
    fields = {column.name for column in output("detectors", 1 << 30).blocks[0].columns}
    assert {"condition.parity_arma.active", "condition.unknown_input.value"} <= fields
    assert {"gap", "sensor_non_finite.position", "sensor_saturated.acceleration"} <= set(
        raised["troubled"]
    )


def test_a_live_recording_replays_to_the_same_bits(tmp_path: Path) -> None:
    """Estimates made in blocks of 1, 3 and 8 as they came, recorded, replayed from the file."""
    model = load_model(HERE / "model.toml")
    session = open_session(HERE / "friction.mcap")
    for size in (1, 3, 8):
        path = tmp_path / f"live{size}.mcap"
        live = RigMonitor(model)
        with SessionWriter(path, session.info) as writer:
            for merged in session.samples():
                for block in pieces(merged, size):
                    writer.write(block)
                    watched = live.update(block)
                    assert watched is not None
                    writer.write(watched.estimates)
                    for announcement in watched.announcements:
                        writer.write(announcement)
        again = tmp_path / f"again{size}.mcap"
        model_file = str(HERE / "model.toml")
        assert main(["replay", str(path), "--model", model_file, "--out", str(again)]) == 0
        for topic in ("estimates", "alarms", "samples"):
            assert recorded(again, topic) == recorded(path, topic)


def recorded(path: Path, topic: str) -> list[bytes]:
    session = open_session(path)
    if topic in ("estimates", "samples"):
        return [encode(block) for block in getattr(session, topic)(size=1 << 30)]
    return [encode(item.message) for item in session.messages([topic])]


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """The cases in a folder of their own, to be changed."""
    for name in ("cases.toml", "model.toml"):
        shutil.copy(HERE / name, tmp_path)
    for path in HERE.glob("friction*.mcap"):
        shutil.copy(path, tmp_path)
    return tmp_path


def change_model(folder: Path) -> None:
    model = folder / "model.toml"
    lines = model.read_text().splitlines()
    at = lines.index("[window]")
    key = next(i for i in range(at, len(lines)) if lines[i].startswith("length"))
    lines[key] = "length = 64"
    model.write_text("\n".join(lines))


def test_a_change_is_reported_with_field_sample_old_and_new(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change_model(copied)
    cases = str(copied / "cases.toml")
    assert main(["verify", cases, "--only", "friction"]) == 1
    text = capsys.readouterr().out
    theta = next(line for line in text.splitlines() if line.startswith("  friction: theta1,"))
    assert ", sample " in theta
    assert " → " in theta
    assert "further samples differ" in theta
    assert main(["verify", cases, "--only", "friction", "--update"]) == 0
    assert main(["verify", cases, "--only", "friction"]) == 0
    assert "as in the reference" in capsys.readouterr().out


def test_fields_can_be_ignored_or_given_room(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change_model(copied)
    cases = copied / "cases.toml"
    ignoring = 'name = "friction"\nignore = ["theta*", "announcement.*", "condition.*"]'
    text = cases.read_text().replace('name = "friction"', ignoring)
    cases.write_text(text)
    assert main(["verify", str(cases), "--only", "friction"]) == 1
    assert "theta" not in capsys.readouterr().out
    cases.write_text(text.replace('"condition.*"]', '"condition.*"]\ntolerance = { "*" = 1e9 }'))
    assert main(["verify", str(cases), "--only", "friction"]) == 0


def test_a_missing_reference_fails_until_it_is_made(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (copied / "friction.reference.mcap").unlink()
    cases = str(copied / "cases.toml")
    assert main(["verify", cases, "--only", "friction"]) == 1
    assert "there is no reference yet" in capsys.readouterr().out
    assert main(["verify", cases, "--only", "friction", "--update"]) == 0
    made = (copied / "friction.reference.mcap").read_bytes()
    assert main(["verify", cases, "--only", "friction", "--update"]) == 0
    assert (copied / "friction.reference.mcap").read_bytes() == made


def test_wrong_cases_are_one_line(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cases = copied / "cases.toml"
    assert main(["verify", str(cases), "--only", "frction"]) == 2
    assert "found no case 'frction'" in capsys.readouterr().err
    cases.write_text(cases.read_text().replace("recording =", "recordng ="))
    assert main(["verify", str(cases)]) == 2
    assert "recordng" in capsys.readouterr().err


def test_the_recordings_stay_small() -> None:
    assert sum(path.stat().st_size for path in HERE.glob("*.mcap")) < 600_000
