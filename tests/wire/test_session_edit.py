"""Looking into, cutting and rescuing sessions, through the commands that people type."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from rigwatch.commands import main
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.wire.messages import encode
from rigwatch.wire.messages.message_types import (
    Alarm,
    AlarmCommand,
    AlarmState,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    SampleBlock,
)
from rigwatch.wire.session import SessionWriter, open_session, run_info
from rigwatch.wire.session.edit import recover, trim
from rigwatch.wire.session.summary import summarise

T0 = 1_767_225_600_000_000_000
STEP = 3_906_250


def samples(seq: int, n: int, boot: int = 7) -> SampleBlock:
    index = np.arange(seq, seq + n)
    flags = np.where(index % 100 == 50, 2, 0).astype(np.uint8)
    values = index.astype(np.float64)
    columns = (Column("voltage", "V", values, flags), Column("position", "m", -values))
    return SampleBlock("rig", boot, seq, index * 3906, T0 + index * STEP, columns)


def estimates(seq: int, n: int) -> EstimateBlock:
    index = np.arange(seq, seq + n)
    column = Column("theta1", "", index.astype(np.float64))
    return EstimateBlock("rig", 7, seq, T0 + index * STEP, (column,))


def alarm(name: str, state: AlarmState, seq: int) -> Alarm:
    low, high = -np.inf, 2.0
    return Alarm(
        name, state, "error", "friction", "stop", "rig", 7, seq, T0 + seq * STEP, 3.0, low, high,
        True, "", seq,
    )  # fmt: skip


def write(path: Path, messages: list[Message], notes: str = "") -> Path:
    with SessionWriter(path, run_info("bench1", 256.0, t_ns=T0, notes=notes)) as writer:
        for message in messages:
            writer.write(message)
            writer.flush()
    return path


@pytest.fixture
def session(tmp_path: Path) -> Path:
    messages: list[Message] = []
    for seq in range(0, 1000, 100):
        messages += [samples(seq, 100), estimates(seq, 100)]
        if seq == 200:
            messages.append(alarm("link", "unacknowledged", 250))
            messages.append(alarm("gap", "unacknowledged", 260))
        if seq == 300:
            messages.append(alarm("gap", "normal", 310))
        if seq == 700:
            messages.append(alarm("dry_friction", "unacknowledged", 750))
    messages += [samples(1100, 50), Gap("rig", 7, 1000, 1099, T0, "recorder", "not in the ring")]
    return write(tmp_path / "a.mcap", [*messages, samples(0, 20, boot=8)])


def output(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main([*arguments, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_info(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = output(capsys, "info", str(session))
    (device,) = found["devices"]
    assert (device["samples"], device["boots"]) == (1070, 2)
    assert (device["gaps"], device["missing"]) == (1, 100)
    assert device["rate_hz"] == pytest.approx(256.0)
    assert device["longest_step_s"] == pytest.approx(STEP / 1e9)
    voltage, position = device["channels"]
    assert voltage["flags"] == {"saturated": 10, "good": 1060}
    assert (voltage["low"], voltage["high"]) == (0.0, 1149.0)
    assert position["flags"] == {"good": 1070}
    assert (found["unknown_ends"], found["lost_messages"]) == (0, {})
    assert found["topics"]["alarms"] == 4
    assert [item["name"] for item in found["alarms"]] == ["link", "gap", "gap", "dry_friction"]
    assert found["alarms"][0]["low"] is None
    assert found["duration_s"] == pytest.approx(1149 * STEP / 1e9)
    assert found["lost"] == []
    assert found["unclosed"] == []
    assert main(["info", str(session)]) == 0
    text = capsys.readouterr().out
    assert "1070 samples at 256.000 Hz" in text
    assert "1 gap(s) with 100 samples missing" in text
    assert "dry_friction unacknowledged" in text


def test_trim_by_seconds(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "b.mcap"
    start, end = 400 * STEP / 1e9, 800 * STEP / 1e9
    options = ["--start", repr(start), "--end", repr(end)]
    found = output(capsys, "trim", str(session), str(target), *options)
    part = open_session(target)
    (block,) = part.samples()
    assert encode(block) == encode(samples(400, 400))
    assert found["samples"] == 400
    alarms = [item.message for item in part.messages(["alarms"])]
    assert [item.name for item in alarms if isinstance(item, Alarm)] == ["link", "dry_friction"]
    assert part.info.rig == "bench1"
    assert "trimmed to 2026-01-01T00:00:01.562Z" in part.info.notes
    assert part.info.configuration == open_session(session).info.configuration


def test_trim_by_time_of_day(session: Path, tmp_path: Path) -> None:
    target = tmp_path / "b.mcap"
    assert main(["trim", str(session), str(target), "--start", "2026-01-01T01:00:02+01:00"]) == 0
    first = next(open_session(target).samples())
    assert first.t_ns[0] >= T0 + 2 * 10**9
    assert first.seq == 512


def test_trim_refuses_an_empty_span_and_keeps_no_file(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "b.mcap"
    assert main(["trim", str(session), str(target), "--start", "900"]) == 2
    assert (
        f"{session}: found no samples from 2026-01-01T00:15:00.000Z to the end, expected a part of"
        " 2026-01-01T00:00:00.000Z to 2026-01-01T00:00:04.488Z (4.488 s)"
    ) in capsys.readouterr().err
    span = ["--start", "2", "--end", "1"]
    assert main(["trim", str(session), str(target), *span]) == 2
    assert "--end: found 1, expected a time after --start 2" in capsys.readouterr().err
    between = ["--start", "3.91", "--end", "4.29"]  # only the gap lies there
    assert main(["trim", str(session), str(target), *between]) == 2
    assert main(["trim", str(session), str(target), "--start", "soon"]) == 2
    assert "--start: found 'soon', expected seconds" in capsys.readouterr().err
    assert not target.exists()


def test_times_of_a_log_without_a_date_are_told_in_seconds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, session = tmp_path / "run.csv", tmp_path / "run.mcap"
    log.write_text("t,u\n" + "".join(f"{5 + 0.01 * i:.2f},{i}\n" for i in range(201)))
    import_file(log, session, ImportMapping(channels={"voltage": "u[V]"}, time="t[s]"))
    assert main(["trim", str(session), str(tmp_path / "b.mcap"), "--start", "9"]) == 2
    first = summarise(open_session(session)).start_ns / 1e9
    told = f"found no samples from {first + 9:.3f} s to the end"
    assert f"{told}, expected a part of {first:.3f} s to" in capsys.readouterr().err


def test_recover_a_killed_and_damaged_session(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = bytearray(session.read_bytes())
    content[len(content) // 2] ^= 0x10
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(content[: len(content) * 3 // 4])
    target = tmp_path / "saved.mcap"
    found = output(capsys, "recover", str(broken), str(target))
    assert len(found["lost"]) >= 1
    again = open_session(target)
    assert again.lost == ()
    assert again.unclosed == ()
    assert encoded(target) == encoded(broken)
    with target.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.channel_message_counts[3] == found["messages"]["alarms"] == 4


def encoded(path: Path) -> list[bytes]:
    """All samples and estimates, however they are cut."""
    session = open_session(path)
    return [
        *(encode(block) for block in session.samples()),
        *(encode(block) for block in session.estimates()),
    ]


def test_recover_without_the_head_reports_it(session: Path, tmp_path: Path) -> None:
    content = bytearray(session.read_bytes())
    content[150] ^= 0xFF
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(content)
    written = recover(open_session(broken), tmp_path / "saved.mcap")
    assert "the description of the run was lost" in written.notes
    info = open_session(tmp_path / "saved.mcap").info
    assert (info.rig, info.sample_rate_hz) == ("unknown", 256.0)
    assert written.samples == 1070


def test_recover_joins_segments(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    folder.mkdir()
    for number in range(3):
        write(folder / f"{number:06d}.mcap", [samples(number * 100, 110)])
    written = recover(open_session(folder), tmp_path / "one.mcap")
    assert written.messages["run"] == 1
    assert written.samples == 310
    assert sum(map(len, open_session(tmp_path / "one.mcap").samples())) == 310


def test_what_any_client_may_say_does_not_move_the_times_of_a_session(tmp_path: Path) -> None:
    ahead = T0 + 50 * 365 * 86_400 * 10**9  # such a session was never old enough to be removed
    said = [
        Event("eve", ahead, "info", "X", ""),
        Event("eve", 0, "info", "X", ""),
        AlarmCommand("stale", "shelve", "eve", ahead, "", ""),
        Health("eve", ahead, "running", "", {}),
        Gap("rig", 7, 5, 5, ahead, "eve", ""),
    ]
    summary = summarise(open_session(write(tmp_path / "a.mcap", [samples(0, 257), *said])))
    assert summary.start_ns == T0
    assert summary.duration_s == pytest.approx(256 * STEP / 1e9)
    (tmp_path / "none").mkdir()
    alone = summarise(open_session(write(tmp_path / "none" / "a.mcap", said[:2])))
    assert (alone.start_ns, alone.end_ns) == (0, ahead)


def test_a_summary_of_nothing_but_a_head(tmp_path: Path) -> None:
    summary = summarise(open_session(write(tmp_path / "a.mcap", [])))
    assert summary.duration_s == 0.0
    assert summary.devices == []
    assert main(["info", str(tmp_path / "a.mcap")]) == 0


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_no_damage_makes_a_command_fall_over(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Bit flips and truncation under info, recover and trim: a result or one plain line."""
    folder = tmp_path_factory.mktemp("damage")
    content = bytearray(write(folder / "a.mcap", [samples(0, 50), estimates(0, 50)]).read_bytes())
    for _ in range(data.draw(st.integers(0, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    broken = folder / "b.mcap"
    broken.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        opened = open_session(broken)
        summarise(opened)
        recover(opened, folder / "c.mcap")
        trim(opened, folder / "d.mcap", T0 + STEP, None)
    except RigwatchError as error:
        one_line = str(error)
        assert "\n" not in one_line, one_line


@pytest.mark.parametrize("start", ["1e12", "1e30"])
def test_a_span_beyond_all_dates_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], start: str
) -> None:
    with SessionWriter(tmp_path / "run.mcap", run_info("bench", 256.0, t_ns=T0)) as writer:
        writer.write(samples(0, 10))
    words = ["trim", f"{tmp_path / 'run.mcap'}", f"{tmp_path / 'part.mcap'}", "--start", start]
    assert main(words) == 2
    assert "found no samples from" in capsys.readouterr().err


def test_the_rate_of_a_slow_log_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A sample a day is not one at 0.000 Hz."""
    log, session = tmp_path / "level.csv", tmp_path / "level.mcap"
    log.write_text("t,level\n0,1\n86400,2\n172800,3\n")
    import_file(log, session, ImportMapping(channels={"level": "level[m]"}, time="t[s]"))
    assert main(["info", f"{session}"]) == 0
    assert "3 samples at 1.157e-05 Hz, longest step 86400 s" in capsys.readouterr().out


@pytest.mark.parametrize("at", [100, 250, 999], ids=["between blocks", "within", "the last"])
@pytest.mark.parametrize("by_s", [-3600.0, -1.0, 1.0, 3600.0, 1e8])
def test_a_clock_that_was_set_changes_no_rate_and_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], by_s: float, at: int
) -> None:
    blocks = [
        replace(one, t_ns=one.t_ns + round(by_s * 1e9) * (one.seq + np.arange(len(one)) >= at))
        for one in (samples(seq, 100) for seq in range(0, 1000, 100))
    ]
    path = write(tmp_path / "set.mcap", [*blocks])
    (device,) = output(capsys, "info", str(path))["devices"]
    assert device["rate_hz"] == pytest.approx(256.0, rel=1e-4)
    assert device["longest_step_s"] == pytest.approx(STEP / 1e9, rel=1e-3)
    assert device["clock_steps"] == 1
    assert main(["info", str(path)]) == 0
    assert "with 0 samples missing, clock set 1 time(s)\n" in capsys.readouterr().out


@pytest.mark.parametrize("jump_s", [0.0, 5.0, -5.0], ids=["pause", "pause and jump", "set back"])
def test_a_pause_of_the_device_is_no_clock_that_was_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], jump_s: float
) -> None:
    late = samples(500, 500)
    moved = late.device_us + round((2.0 + jump_s) * 1e6)
    late = replace(late, t_ns=late.t_ns + 2 * 10**9, device_us=moved)
    path = write(tmp_path / "paused.mcap", [samples(0, 500), late])
    (device,) = output(capsys, "info", str(path))["devices"]
    assert device["longest_step_s"] == pytest.approx(2.0 + STEP / 1e9)
    assert device["clock_steps"] == 0


def test_a_device_whose_clock_jumps_has_no_clock_that_was_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = samples(500, 500)
    path = write(
        tmp_path / "jump.mcap", [samples(0, 500), replace(late, device_us=late.device_us + 10**7)]
    )
    (device,) = output(capsys, "info", str(path))["devices"]
    assert device["rate_hz"] == pytest.approx(256.0)
    assert device["clock_steps"] == 0
