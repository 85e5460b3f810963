"""`rigwatch view` shows a recording as a live screen would, or draws it into a file."""

import json
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rigwatch.commands import main
from rigwatch.commands.sessions.session_messages import length_of, messages_of
from rigwatch.dashboard.board import palette
from rigwatch.wire.messages import Alarm, EstimateBlock, Health, Message, RunInfo, SampleBlock
from rigwatch.wire.session import SessionWriter, message_time, open_session, run_info
from tests.dashboard.rig_messages import START_NS, Rig

RECORDINGS = Path(__file__).parents[1] / "verify"


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds in which friction appears, with the monitor's results."""
    path = tmp_path_factory.mktemp("session") / "rubbing.mcap"
    with SessionWriter(path, run_info("bench", 256.0)) as writer:
        for message in Rig(friction_at=4.0).messages(8.0):
            writer.write(message)
    return path


@pytest.mark.nightly
def test_the_picture_shows_signals_and_verdict(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The viewer's notices may be in the picture.
    monkeypatch.setattr("rigwatch.dashboard.viewer.picture._FRAMES", 8)
    picture = tmp_path / "rubbing.png"
    assert main(["view", str(session), "--picture", str(picture)]) == 0
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    for colour in (palette.VOLTAGE, palette.POSITION, palette.ACCELERATION, palette.THETA1):
        assert (np.abs(pixels - np.array(colour)).max(axis=2) < 40).sum() > 300, colour
    red = np.array(palette.VERDICTS["dry_friction"][1]) * 0.78
    assert (np.abs(pixels - red).max(axis=2) < 15).sum() > 500
    assert picture.stat().st_size < 400_000


def test_without_a_graphics_driver_it_is_told_what_a_picture_needs(
    session: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("WGPU_BACKEND", "dx12")  # of another system
    picture = tmp_path / "rubbing.png"
    assert main(["view", str(session), "--picture", str(picture)]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "it needs a graphics driver" in said
    assert not picture.exists()


def test_a_file_for_the_viewer_holds_the_whole_recording(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "rubbing.rrd"
    assert main(["view", str(session), "--save", str(target), "--json"]) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn["samples"] == 8 * 256
    assert drawn["fault_ns"] - drawn["start_ns"] == pytest.approx(4.8e9, abs=0.1e9)
    assert target.stat().st_size > 100_000


def test_a_part_of_it(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "part.rrd"
    main(["view", str(session), "--start", "1", "--end", "2", "--save", str(target), "--json"])
    assert json.loads(capsys.readouterr().out)["samples"] == 256


def test_a_part_that_begins_after_an_alarm_shows_that_it_stands(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    opened = open_session(session)
    first = next(opened.samples()).t_ns[0]
    span = (int(first) + 6_000_000_000, int(first) + 7_000_000_000)
    said = next(messages_of(opened, span, None))
    assert isinstance(said, Alarm)
    assert (said.name, said.state, said.t_ns) == ("dry_friction", "unacknowledged", span[0])
    # The cursor stays at the end, as nothing is raised within the part.
    view = ["view", str(session), "--start", "6", "--end", "7", "--save", str(tmp_path / "x.rrd")]
    assert main([*view, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fault_ns"] == 0


def set_back(message: Message, at_ns: int, by_ns: int) -> Message:
    """A message that was said after the clock was set back at a time."""
    t_ns = message.t_ns - by_ns * (message.t_ns >= at_ns)
    return replace(message, t_ns=t_ns)  # type: ignore[arg-type]


@pytest.mark.parametrize("back_s", [11, 3600, 10**8])
def test_where_the_clock_was_set_back_a_recording_is_drawn_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], back_s: int
) -> None:
    path, steady = tmp_path / "set.mcap", list(Rig(friction_at=4.0).messages(8.0))
    # A recorder writes a second's samples before what else was said in it.
    by_second = sorted(steady, key=lambda one: (message_time(one) // 10**9, rank(one)))
    with SessionWriter(path, run_info("bench", 256.0, t_ns=START_NS)) as writer:
        for _, second in groupby(by_second, lambda one: message_time(one) // 10**9):
            for message in second:
                writer.write(set_back(message, START_NS + 5_250_000_000, back_s * 10**9))
            writer.flush()
    shown = [one for one in messages_of(open_session(path), (None, None), None) if _is_drawn(one)]
    times = [message_time(one) for one in shown]
    assert times == sorted(times)
    assert times[-1] - times[0] < 8e9
    said = [one for one in shown if isinstance(one, Alarm | Health)]
    meant = [one.t_ns for one in steady if isinstance(one, Alarm | Health)]
    assert [one.t_ns for one in said] == pytest.approx(meant, abs=5e6)
    assert main(["view", str(path), "--save", str(tmp_path / "set.rrd"), "--json"]) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn["samples"] == 8 * 256
    assert drawn["end_ns"] - drawn["start_ns"] == pytest.approx(8e9, abs=0.1e9)
    assert length_of(open_session(path), (None, None)) == pytest.approx(8.0, abs=0.1)


def rank(message: Message) -> int:
    kinds = (SampleBlock, EstimateBlock)
    return kinds.index(type(message)) if isinstance(message, kinds) else len(kinds)


def _is_drawn(message: Message) -> bool:
    return not isinstance(message, RunInfo)


def test_a_recording_without_estimates_is_judged_with_a_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, rubbing = RECORDINGS / "model.toml", RECORDINGS / "friction.mcap"
    target = tmp_path / "rubbing.rrd"
    view = ["view", str(rubbing), "--model", str(model), "--save", str(target), "--json"]
    assert main(view) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn["start_ns"] < drawn["fault_ns"] < drawn["end_ns"]


def test_no_session(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", str(tmp_path / "none.mcap"), "--save", str(tmp_path / "x.rrd")]) == 2
    assert "none.mcap: no such file" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--save", "--picture"])
def test_a_missing_folder_is_named(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    target = tmp_path / "nowhere" / "file"
    assert main(["view", str(session), option, str(target)]) != 0
    assert f"{target}: found no folder {target.parent}" in capsys.readouterr().err
