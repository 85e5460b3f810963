"""`rigwatch replay`: alarms as they come, a summary, a new session, and clear refusals."""

import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from monitor.model import load_model
from monitor.pipeline import RigMonitor
from rigwatch.commands import main
from rigwatch.commands.sessions.replay import Announcer
from rigwatch.replay.run import judge
from rigwatch.replay.source import items
from rigwatch.wire.bus import command_mark, taken
from rigwatch.wire.messages import cut
from rigwatch.wire.messages.message_types import (
    Alarm,
    AlarmCommand,
    Event,
    ModelChange,
    SampleBlock,
)
from rigwatch.wire.session import SessionWriter, open_session, run_info

HERE = Path(__file__).parent
MODEL = ["--model", str(HERE / "model.toml")]
FRICTION = str(HERE / "friction.mcap")


def test_alarms_and_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", FRICTION, *MODEL]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any("dry_friction: unacknowledged" in line for line in lines)
    assert "2048 samples, 8.0 s in" in lines[-1]
    assert "dry_friction" in lines[-1]


def test_a_value_told_again_is_printed_with_it(capsys: pytest.CaptureFixture[str]) -> None:
    main(["replay", FRICTION, *MODEL, "--json"])
    told = json.loads(capsys.readouterr().out)["alarms"]
    alarm = next(Alarm(**one) for one in told if one["name"] == "dry_friction")

    announce = Announcer()
    announce(alarm)
    figure = f"{alarm.cause}: 0.47 N of friction"
    announce(replace(alarm, seq=alarm.seq + 64, value=0.47, cause=figure))

    first, again = capsys.readouterr().out.splitlines()
    assert "dry_friction: unacknowledged" in first
    assert ", told again" not in first
    assert ", told again (" in again
    assert again.endswith(": 0.47 N of friction)")


def test_a_recording_too_short_to_arm_says_that_nothing_was_judged(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["replay", FRICTION, *MODEL, "--start", "0", "--end", "0.5"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert "nothing was judged" in last
    assert "replay a longer recording" in last

    assert main(["replay", FRICTION, *MODEL, "--start", "0", "--end", "0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["armed"] == 0


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", FRICTION, *MODEL, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["samples"] == 2048
    assert "dry_friction" in [alarm["name"] for alarm in found["alarms"]]
    assert 0 < found["armed"] < found["samples"]
    assert found["lost"] == []
    assert found["times_real_time"] > 0


def test_a_part_at_a_given_speed(capsys: pytest.CaptureFixture[str]) -> None:
    began = time.monotonic()
    options = ["--start", "1", "--end", "2", "--speed", "4"]
    assert main(["replay", FRICTION, *MODEL, *options, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 256
    assert time.monotonic() - began > 0.9 / 4


def test_a_new_session_has_samples_estimates_and_alarms(tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    assert main(["replay", FRICTION, *MODEL, "--out", str(out)]) == 0
    session = open_session(out)
    assert sum(map(len, session.samples())) == 2048
    assert sum(map(len, session.estimates())) == 2048
    assert [item.topic.name for item in session.messages(["alarms"])]
    assert "replayed from friction.mcap" in session.info.notes


def test_operators_commands_fall_between_the_same_samples_however_it_is_cut() -> None:
    session = open_session(HERE / "troubled.mcap")
    for size in (1, 7, 16384):
        before = 0
        for item in items(session, size=size):
            if isinstance(item, AlarmCommand):
                break
            before += len(item)
        assert before == 1000 - 4


@pytest.mark.parametrize("back_s", [0, 3600])
@pytest.mark.parametrize("size", [7, 4096])
def test_a_model_change_falls_before_its_sample_wherever_the_clock_was_set(
    tmp_path: Path, back_s: int, size: int
) -> None:
    path, (block,) = tmp_path / "set.mcap", open_session(FRICTION).samples()
    first, second = cut(block, 0, 1000), cut(block, 1000, len(block))
    with SessionWriter(path, run_info("simulated", 256.0)) as writer:
        writer.write(first)
        writer.write(replace(second, t_ns=second.t_ns - back_s * 10**9))
        for seq, t_ns in ((1000, first.t_ns[-1] + 1), (1500, block.t_ns[1500] - back_s * 10**9)):
            writer.write(ModelChange(block.device, block.boot, seq, int(t_ns), "ann", "", "", ""))
    found: list[tuple[int, int]] = []
    samples = 0
    for item in items(open_session(path), size=size):
        if isinstance(item, SampleBlock):
            samples += len(item)
        elif isinstance(item, ModelChange):
            found.append((item.seq, samples))
    assert found == [(1000, 1000), (1500, 1500)]
    assert samples == len(block)


@pytest.mark.parametrize("ahead_s", [0, 3600 * 24 * 365])
@pytest.mark.parametrize("back_s", [0, 120, 3600])
@pytest.mark.parametrize("size", [7, 4096])
def test_a_command_falls_behind_its_sample_wherever_clocks_were_set(
    tmp_path: Path, size: int, back_s: int, ahead_s: int
) -> None:
    """That of the samples back, and that of the operator far ahead."""
    path, (block,) = tmp_path / "set.mcap", open_session(FRICTION).samples()
    later = cut(block, 1000, 1600)
    later = replace(later, t_ns=later.t_ns - back_s * 10**9)
    rest = replace(cut(block, 1600, len(block)), boot=9, seq=0)
    given = []
    with SessionWriter(path, run_info("simulated", 256.0)) as writer:
        for part in (cut(block, 0, 1000), later, rest):
            writer.write(part)
        # The last is the boot's last sample: it falls before the next boot.
        for seq, t_ns in ((999, block.t_ns[999]), (1200, later.t_ns[200]), (1599, later.t_ns[-1])):
            command = AlarmCommand("*", "acknowledge", f"ann {seq}", int(t_ns) + ahead_s * 10**9)
            obeyed = replace(command, t_ns=int(t_ns))
            writer.write(command)
            writer.write(taken(command, obeyed, "monitor/alarms", (block.boot, seq)))
            given.append((seq + 1, obeyed))
    found = list[tuple[int, AlarmCommand]]()
    samples = 0
    for item in items(open_session(path), size=size):
        if isinstance(item, SampleBlock):
            samples += len(item)
        elif isinstance(item, AlarmCommand):
            found.append((samples, item))
    assert found == given
    assert samples == len(block)


def changed(tmp_path: Path, rate: float = 256.0, channels: slice = slice(None)) -> str:
    path = tmp_path / "changed.mcap"
    with SessionWriter(path, run_info("simulated", rate)) as writer:
        for block in open_session(FRICTION).samples():
            writer.write(replace(block, channels=block.channels[channels]))
    return str(path)


@pytest.mark.parametrize("speed", ["0", "-1", "nan", "fast"])
def test_a_wrong_speed_is_refused(speed: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["replay", FRICTION, *MODEL, "--speed", speed])
    assert "--speed" in capsys.readouterr().err


def test_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def refusal(*arguments: str) -> str:
        assert main(["replay", *arguments]) == 2
        text = capsys.readouterr().err
        assert text.count("\n") == 1
        return text

    assert "found no model in its configuration, expected --model" in refusal(FRICTION)
    assert "no such file" in refusal(str(tmp_path / "none"), *MODEL)
    session = changed(tmp_path, rate=100.0)
    assert "found a session of 100 Hz, expected 256 Hz as in the model" in refusal(session, *MODEL)
    Path(session).unlink()
    session = changed(tmp_path, channels=slice(1, 3))
    assert "found the channels position, acceleration, expected 'voltage'" in refusal(
        session, *MODEL, "--out", str(tmp_path / "out.mcap")
    )
    assert not (tmp_path / "out.mcap").exists()


def test_a_block_keeps_its_samples_where_nothing_falls_in() -> None:
    (block,) = items(open_session(FRICTION))
    assert isinstance(block, SampleBlock)
    assert len(block) == 2048


@pytest.mark.parametrize("model", ["", "a = " + "[" * 50_000, "no toml"])
def test_a_forged_change_of_the_model_is_reported_and_left_out(tmp_path: Path, model: str) -> None:
    genuine = open_session(FRICTION)
    path = tmp_path / "forged.mcap"
    with SessionWriter(path, genuine.info) as writer:
        for block in genuine.samples():
            writer.write(block)
        at = int(block.t_ns[256])
        writer.write(ModelChange("rig", block.boot, block.seq, at, "eve", "", model, ""))
    monitor = RigMonitor(load_model(HERE / "model.toml"))
    judged = list(judge(open_session(path), monitor, items(open_session(path))))
    said = [one for item in judged for one in item.announced]
    assert [one.code for one in said if isinstance(one, Event)] == ["MODEL REFUSED"]
    assert "dry_friction" in [one.name for one in said if isinstance(one, Alarm)]


def test_a_command_that_the_monitor_refused_is_not_replayed(tmp_path: Path) -> None:
    path, t_ns = tmp_path / "refused.mcap", 1_767_225_600_000_000_000
    forged = AlarmCommand("*", "acknowledge", "bob", t_ns, "", '{"nonce": "1"}')
    genuine = AlarmCommand("*", "acknowledge", "ann", t_ns + 1, "", '{"nonce": "2"}')
    refused = [f"acknowledge of * refused: why ({command_mark(c)})" for c in (forged, genuine)]
    with SessionWriter(path, run_info("bench", 256.0), sync=False) as writer:
        # The genuine one is repeated by somebody: executed once, then refused.
        for message in (forged, genuine, genuine):
            writer.write(message)
        for text in refused:
            event = Event("monitor/alarms", t_ns, "warning", "alarm_command_refused", text)
            writer.write(event)
    assert list(items(open_session(path))) == [genuine]
