"""The simulated device on a pty keeps its pace, and waits for nobody."""

import os
import threading
import time
from pathlib import Path

import pytest

from rigwatch.wire.device.frame import Frame, FrameDecoder
from rigwatch.wire.errors import DeviceError
from sim_plant.serve.line_faults import NAMES, LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device, Pace
from tests.daq.rig import ToySource, in_thread
from tests.waiting import eventually


def read_frames(port: Path, count: int) -> list[Frame]:
    decoder, frames = FrameDecoder(), list[Frame]()
    fd = os.open(port, os.O_RDONLY | os.O_NOCTTY)
    try:
        while len(frames) < count:
            frames += decoder.feed(os.read(fd, 4096))
    finally:
        os.close(fd)
    return frames


def test_frames_go_on_while_nobody_reads(tmp_path: Path) -> None:
    line = PtyLine(tmp_path / "rig")
    server = SerialServer(Device(ToySource()), line)
    line.plug()
    server.step(2000)
    assert server.sent == 2000
    assert line.dropped == 2000 * 25
    line.unplug()


def test_a_reader_that_stops_reading_never_blocks(tmp_path: Path) -> None:
    with PtyLine(tmp_path / "rig") as line:
        server = SerialServer(Device(ToySource()), line)
        reader = os.open(line.link, os.O_RDONLY | os.O_NOCTTY)
        server.step(5000)
        os.close(reader)
        assert line.dropped > 0


def test_the_schedule_is_absolute(tmp_path: Path) -> None:
    server = SerialServer(Device(ToySource()), PtyLine(tmp_path / "rig"))
    began = time.monotonic()
    with in_thread(server.run):
        frames = []
        eventually((tmp_path / "rig").is_symlink, "the line")
        frames = read_frames(tmp_path / "rig", 128)[:128]
    elapsed = time.monotonic() - began
    assert [f.seq for f in frames] == list(range(frames[0].seq, frames[0].seq + 128))
    assert server.sent <= elapsed * 256 + 1


def test_a_standstill_is_made_up_for_or_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0]
    monkeypatch.setattr(time, "monotonic_ns", lambda: now[0])
    pace = Pace(256.0)
    assert pace.due() == 1
    now[0] = 500_000_000
    assert pace.due() == 128
    now[0] = 10_500_000_000
    assert pace.due() == 1
    assert pace.until_next() == pytest.approx(1 / 256, abs=1e-4)


def test_an_old_link_is_replaced_and_a_file_is_not(tmp_path: Path) -> None:
    (tmp_path / "rig").symlink_to("/nowhere")
    with PtyLine(tmp_path / "rig") as line:
        assert line.link.resolve().exists()
    (tmp_path / "precious").write_text("data")
    with pytest.raises(DeviceError, match="cannot link the line here"):
        PtyLine(tmp_path / "precious").plug()
    assert (tmp_path / "precious").read_text() == "data"


def test_a_fault_lasts_as_long_as_told(tmp_path: Path) -> None:
    faults = LineFaults()
    faults.start("lose", 2)
    assert [faults.apply(b"abc\0") for _ in range(3)] == [b"", b"", b"abc\0"]
    faults.start("duplicate")
    assert faults.apply(b"a\0") == b"a\0a\0"
    faults.stop("duplicate")
    assert faults.apply(b"a\0") == b"a\0"
    with pytest.raises(DeviceError, match="expected one of garbage"):
        faults.start("gremlins")
    assert "unplug" in NAMES


def test_stop_ends_the_server_and_takes_the_link_away(tmp_path: Path) -> None:
    server, stop = SerialServer(Device(ToySource()), PtyLine(tmp_path / "rig")), threading.Event()
    stop.set()
    server.run(stop)
    assert not (tmp_path / "rig").is_symlink()
