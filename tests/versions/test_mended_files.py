"""`rigwatch doctor` reads what the processes read, and `--fix` mends it with a backup.

The files are those of earlier versions, moved into one rig; some are damaged as a kill leaves them.
"""

import json
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from shutil import copy

import pytest

from monitor.alarms import read_journal
from monitor.model import load_model, model_versions
from rigwatch.commands import main
from rigwatch.recorder import newest
from rigwatch.wire.bus import KeptMessages
from rigwatch.wire.host.ports import free_port
from rigwatch.wire.messages import encode
from rigwatch.wire.ordering import Numbered
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session

HERE = Path(__file__).parent
VERSIONS = ("2026-11-20", "2026-11-22")
Findings = dict[str, dict[str, str]]


def rig_of(version: str, folder: Path) -> Path:
    """The rig that a version left behind, in a folder of its own."""
    for name in ("model.toml", "alarms.jsonl", "alarms.jsonl.position"):
        copy(HERE / version / name, folder)
    text = (HERE / version / "rig.toml").read_text()
    text = text.replace("/var/lib/rig", str(folder)).replace("7447", str(free_port()))
    (folder / "rig.toml").write_text(text)
    for stamp in ("20261119T120000Z", "20261120T120000Z"):
        session = folder / "sessions" / f"demo-{stamp}"
        session.mkdir(parents=True)
        copy(HERE / version / "session.mcap", session / "000001.mcap")
    return folder / "rig.toml"


def findings(capsys: pytest.CaptureFixture[str], rig: Path, *more: str) -> list[dict[str, str]]:
    capsys.readouterr()
    code = main(["doctor", str(rig), "--json", *more])
    printed = capsys.readouterr()
    assert printed.out, (code, printed.err)
    found: list[dict[str, str]] = json.loads(printed.out)
    return found


def doctor(capsys: pytest.CaptureFixture[str], rig: Path, *more: str) -> Findings:
    return {item["what"]: item for item in findings(capsys, rig, *more)}


def list_of(capsys: pytest.CaptureFixture[str], rig: Path, *more: str) -> list[str]:
    """What is said of unfinished files."""
    found = findings(capsys, rig, *more)
    return [item["text"] for item in found if item["what"] == "unfinished"]


def of_rig(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def cut(path: Path, part: float) -> None:
    """The file as a kill leaves it."""
    path.write_bytes(path.read_bytes()[: round(path.stat().st_size * part)])


@pytest.mark.parametrize("version", VERSIONS)
def test_files_of_an_earlier_version_are_mended_once_with_a_backup_of_each(
    version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of(version, tmp_path)
    torn = tmp_path / "sessions" / "demo-20261119T120000Z" / "000001.mcap"
    cut(torn, 0.9)
    cut(tmp_path / "alarms.jsonl", 0.97)
    (tmp_path / "alarms.jsonl.position").write_bytes(b"x" * 20)
    positions = torn.with_name("positions.json")
    positions.write_text('{"estimates":')
    before = of_rig(tmp_path)
    standing, unread = read_journal(tmp_path / "alarms.jsonl")
    assert unread == 1
    samples = sum(map(len, open_session(torn).samples()))

    told = doctor(capsys, rig)
    wanted = {"journal", "position", "positions", "session"}
    if version == "2026-11-20":
        wanted |= {"model"}
        assert "noise.repeat" in told["model"]["text"]
    assert {what for what in told if "--fix" in told[what]["remedy"]} == wanted
    assert of_rig(tmp_path) == before  # only said

    done = doctor(capsys, rig, "--fix")
    backups = {}
    for what in wanted:
        found = re.search(r"as it was: (\S+\.backup-\S+)$", done[what]["text"])
        assert found, done[what]
        backups[what] = found[1]
    after = of_rig(tmp_path)
    kept = {Path(name).name.partition(".backup-")[0]: name for name in after if "backup" in name}
    assert len(kept) == len(wanted)
    assert all(after[name] == before[name.partition(".backup-")[0]] for name in kept.values())

    assert repr(read_journal(tmp_path / "alarms.jsonl")) == repr((standing, 0))  # with NaN
    session = open_session(torn)
    assert not session.unclosed
    assert sum(map(len, session.samples())) == samples
    assert not positions.exists()
    load_model(tmp_path / "model.toml")
    again = doctor(capsys, rig)
    assert not [what for what in again if "--fix" in again[what]["remedy"]]
    doctor(capsys, rig, "--fix")
    assert of_rig(tmp_path) == after


@pytest.fixture
def writer() -> Iterator["subprocess.Popen[bytes]"]:
    """A process that is there."""
    with subprocess.Popen(["sleep", "600"]) as process:
        yield process
        process.kill()


def test_what_a_killed_process_has_begun_to_write_is_told_and_removed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], writer: "subprocess.Popen[bytes]"
) -> None:
    rig = rig_of("2026-11-22", tmp_path)
    session = tmp_path / "sessions" / "demo-20261119T120000Z"
    number = 2**22 + 1  # larger than any process's
    gone = [
        tmp_path / name for name in (f"model.toml.{number}.part", f"alarms.jsonl.{number}.part")
    ]
    gone.append(session / f"000001.mcap.{number}.part")
    others = [tmp_path / name for name in (f"mine.{number}.part", "model.toml.mine.part")]
    others.append(tmp_path / f"rig.toml.{writer.pid}.part")
    again = tmp_path / "rig.toml.1.part"  # its number is another process's by now
    for file in (*gone, *others, again):
        file.write_text("begun")
    os.utime(again, (1.0, 1.0))
    told = list_of(capsys, rig)
    assert sorted(line.partition(":")[0] for line in told) == sorted(map(str, (*gone, again)))
    list_of(capsys, rig, "--fix")
    assert not [file for file in (*gone, again) if file.exists()]
    assert all(file.read_text() == "begun" for file in others)
    assert not list(tmp_path.rglob("*.part.backup-*"))
    assert list_of(capsys, rig) == []


def test_a_session_that_is_closed_afterwards_keeps_its_age(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-22", tmp_path)
    first = tmp_path / "sessions" / "demo-20261119T120000Z" / "000001.mcap"
    cut(first, 0.9)
    os.utime(first, (1e9, 1e9))
    doctor(capsys, rig, "--fix")
    assert not open_session(first).unclosed
    assert first.stat().st_mtime == 1e9
    assert newest(tmp_path / "sessions", "demo").name == "demo-20261120T120000Z"


def test_a_silence_that_earlier_versions_took_is_removed_and_all_else_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-20", tmp_path)
    slow = rig.read_text().replace("sample_rate = 256.0", "sample_rate = 1.0 # slow")
    slow = re.sub(r"(?ms)^\[monitor\].*?(?=^\[recorder\])", "", slow)
    rig.write_text(slow)
    told = doctor(capsys, rig)["configuration"]
    assert told["level"] == "fail"
    assert "--fix: remove daq.stale_after" in told["remedy"]
    assert rig.read_text() == slow
    doctor(capsys, rig, "--fix")
    assert load_rig(rig).stale_after == 3.0
    assert rig.read_text() == slow.replace("stale_after = 0.5\n", "")
    (backup,) = tmp_path.glob("rig.toml.backup-*")
    assert backup.read_text() == slow


def test_the_alarms_that_were_sent_are_told_and_damaged_ones_set_aside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, journal = rig_of("2026-11-22", tmp_path), tmp_path / "alarms.jsonl"
    records, _ = read_journal(journal)
    monitor, witness = (Path(f"{journal}{end}") for end in (".said", ".stale.said"))
    for path in (monitor, witness):
        said = KeptMessages(path)
        for run in (5, 6):
            said.begin(run)
            for number, record in enumerate(records):
                said.write(Numbered(run, number, encode(record.alarm)))
        said.close()
    standing = Path(f"{journal}.stale")
    standing.write_bytes(encode(records[0].alarm))

    told = doctor(capsys, rig)
    sent = f"{2 * len(records)} alarms of 2 runs"
    assert told["alarms sent"] == {
        "what": "alarms sent", "level": "ok", "text": f"{monitor}: {sent}", "remedy": ""
    }  # fmt: skip
    assert told["witness's alarms sent"]["text"] == f"{witness}: {sent}"
    assert told["witness's alarm"]["text"].startswith(f"{standing}: {records[0].alarm.name} is")

    damaged = b"x" + witness.read_bytes()[1:]
    witness.write_bytes(damaged)
    standing.write_bytes(b"x")
    files = {"witness's alarms sent", "witness's alarm"}
    told = doctor(capsys, rig)
    assert {what for what in told if "--fix: set it aside" in told[what]["remedy"]} == files
    doctor(capsys, rig, "--fix")
    assert not files & doctor(capsys, rig).keys()
    (backup,) = tmp_path.glob(f"{witness.name}.backup-*")
    assert backup.read_bytes() == damaged


@pytest.mark.parametrize("name", ["alarms.jsonl.said", "alarms.jsonl.stale.said"])
def test_nothing_is_mended_while_alarms_are_being_sent(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-22", tmp_path)
    cut(tmp_path / "alarms.jsonl", 0.97)
    said = KeptMessages(tmp_path / name)
    assert main(["doctor", str(rig), "--fix"]) == 2
    said.close()
    assert "stopped for --fix" in capsys.readouterr().err


def test_a_promoted_model_stays_the_one_in_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-20", tmp_path)
    model = tmp_path / "model.toml"
    author = model_versions.Author("ann", "study rubbing")
    model_versions.install(model, model.read_text() + "# promoted\n", 1, author)
    doctor(capsys, rig, "--fix")
    assert model_versions.history(model)[-1].sha256 == model_versions.digest_of(model)
    assert model_versions.history(model)[-1].why == "study rubbing"


def test_a_model_that_the_monitor_refuses_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-22", tmp_path)
    model = tmp_path / "model.toml"
    model.write_text(model.read_text().replace("sample_rate = 256.0", "sample_rate = 128.0"))
    told = doctor(capsys, rig)["model"]
    assert (told["level"], "128 Hz" in told["text"]) == ("fail", True)


def test_nothing_is_mended_under_a_running_process(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of("2026-11-22", tmp_path)
    cut(tmp_path / "alarms.jsonl", 0.97)
    before = of_rig(tmp_path)
    with (tmp_path / "alarms.jsonl").open("ab"):
        assert main(["doctor", str(rig), "--fix"]) == 2
    assert "stopped for --fix" in capsys.readouterr().err
    assert of_rig(tmp_path) == before
