"""`rigwatch up` under what its surroundings do: output, configuration, children out of hand."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
import termios
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.demo.rig_file import write_rig_file
from rigwatch.supervisor import RigSet, Supervisor, settled_file
from rigwatch.supervisor.child import LONGEST_LINE
from rigwatch.supervisor.rig_set import GONE_AFTER
from rigwatch.supervisor.settled_file import SettledFile
from rigwatch.wire import file_marks
from rigwatch.wire.rig_config import load_rig, rig_text
from rigwatch.wire.typed_files.shipped import find_config
from tests.monitor_process.test_several import rig_file
from tests.tooling.test_supervisor import WORKER, of_kind, supervise, worker
from tests.tooling.test_up import WITHOUT, Rig, on_a_port_of_its_own
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("rig")


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return on_a_port_of_its_own(write_rig_file(find_config("demo.toml"), tmp_path, "web"))


def child_of(parent: int, name: str) -> int:
    """Process id of the child that runs a command of rigwatch; 0 if there is none."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "stat").read_text().rpartition(")")[2].split()
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if int(status[1]) == parent and status[0] != "Z" and name.encode() in words:
            return int(folder.name)
    return 0


def waiting(pipe: int) -> int:
    """Bytes that wait in a pipe."""
    return int.from_bytes(fcntl.ioctl(pipe, termios.FIONREAD, bytes(4)), sys.byteorder)


@pytest.mark.parametrize(
    "output", [pytest.param("stalled", marks=pytest.mark.nightly), "closed", "full"]
)
def test_the_rig_goes_on_whatever_becomes_of_the_output(output: str, config: Path) -> None:
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)
    if output == "full":
        os.close(writing)
        writing = os.open("/dev/full", os.O_WRONLY)
    command = [sys.executable, "-m", "rigwatch", "up", "--json", *WITHOUT, str(config)]
    with subprocess.Popen(command, stdout=writing, stderr=subprocess.DEVNULL) as up:
        os.close(writing)
        try:
            if output == "stalled":
                eventually(lambda: waiting(reading) > 3000, "the pipe is full")
            elif output == "closed":
                eventually(lambda: waiting(reading) > 0, "it prints")
                os.close(reading)
            for _ in range(2):
                eventually(lambda: child_of(up.pid, "daq") > 0, "daq runs")
                killed = child_of(up.pid, "daq")
                os.kill(killed, signal.SIGKILL)
                eventually(
                    lambda gone=killed: child_of(up.pid, "daq") not in (0, gone), "daq is back"
                )
        finally:
            up.terminate()
        assert up.wait(timeout=40) == 0


def test_a_file_that_is_being_saved_is_read_once_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("[rig]\n[recorder]\n")
    file = SettledFile(path)
    for part in ("", "[rig]\n", "[rig]\n[recorder]\n[witness]\n"):
        path.write_text(part)
        assert not file.has_new_content(), "perhaps a part of it"
    assert file.has_new_content()
    assert not file.has_new_content(), "once"
    path.write_text("")
    assert not file.has_new_content()
    path.write_text("[rig]\n[recorder]\n[witness]\n")
    assert not any(file.has_new_content() for _ in range(3)), "as it was"


def test_files_that_have_not_changed_are_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads = Counter[str]()

    def counted(path: Path) -> str:
        reads[path.name] += 1
        return rig_text(path)

    monkeypatch.setattr(settled_file, "rig_text", counted)
    base, path = tmp_path / "base.toml", tmp_path / "rig.toml"
    base.write_text("[rig]\n")
    path.write_text('base = "base.toml"\n')
    file = SettledFile(path)
    looks = [file.has_new_content() for _ in range(5)]
    assert (looks, reads["rig.toml"]) == ([False] * 5, 6), "it has changed just now"
    monkeypatch.setattr(file_marks, "CERTAIN_AFTER_NS", 0)
    file.has_new_content()
    reads.clear()
    assert not any(file.has_new_content() for _ in range(5))
    assert not reads
    base.write_text("[rig]\n[recorder]\n")
    assert [file.has_new_content() for _ in range(3)] == [False, True, False]
    base.rename(tmp_path / "other.toml")
    assert [file.has_new_content() for _ in range(3)] == [False, True, False], "it fits no more"


@pytest.fixture
def rig(config: Path) -> Iterator[Rig]:
    running = Rig(config, *WITHOUT)
    yield running
    if running.process.poll() is None:
        running.end()


def test_a_section_that_is_added_or_removed_is_followed(rig: Rig) -> None:
    before = rig.flows("daq")
    text = rig.config.read_text()
    rig.config.write_text(f"{text}\n[witness]\n")
    rig.wait_for("ready", process="witness")
    rig.config.write_text(text)
    changed = rig.wait_for("changed")["text"]
    if "started anew: witness" in changed:  # the change before
        changed = rig.wait_for("changed")["text"]
    assert "ended: witness" in changed
    status = rig.wait_for("status")["processes"]
    assert "witness" not in status
    assert status["daq"]["pid"] == before["daq"]["pid"]
    assert rig.end() == 0


def test_rigs_join_and_leave_with_their_files(config: Path, tmp_path: Path) -> None:
    second = tmp_path / "two" / "second.toml"
    second.parent.mkdir()
    text = config.read_text().replace('id = "demo"', 'id = "second"')
    text = text.replace(str(tmp_path / "serial-line"), str(second.parent / "serial-line"))
    second.write_text(f"{text}\n[rgi]\n")
    rig = Rig(config, *WITHOUT, str(second))
    try:
        rig.wait_for("started", process="plant demo")
        second.write_text(text)
        assert "second joins" in rig.wait_for("changed")["text"]
        rig.wait_for("ready", process="plant second")
        rig.flows("daq", more_than=400.0)
        second.unlink()
        assert "second leaves" in rig.wait_for("changed")["text"]
        rig.wait_for("stopped", process="plant second")
        rig.flows("daq")
        assert rig.end() == 0
    finally:
        rig.process.kill()


def test_an_endless_line_takes_no_memory_and_hides_no_later_line() -> None:
    endless = (
        "import sys\nfor _ in range(30): sys.stdout.write('x' * 65536)\nprint()\nprint('done')\n"
    )
    events = supervise(
        [worker("daq", endless + WORKER.format(step=1))],
        lambda _, events: any(one.text == "done" for one in of_kind(events, "daq", "says")),
    )
    said = [one.text for one in of_kind(events, "daq", "says")]
    assert max(map(len, said)) <= LONGEST_LINE + 1
    assert said[1] == "done"


AWAY = "import os, time; os.setresuid(*[65534] * 3); print('away', flush=True); time.sleep(600)"
SUPERVISED = """
import sys
from tests.monitor_process.test_several import rig_file
from tests.tooling.test_supervisor import *
away = ProcessPlan("away", (sys.executable, "-c", sys.argv[1]))
limits = Limits(start=1.0, stop=5.0, first_pause=0.1, longest_pause=0.5)
events = []
# The last one is stopped first.
supervisor = Supervisor([worker("daq"), away], events.append, limits)
def turn():
    told = [event for event in events if "cannot be killed" in event.text]
    if len(told) >= 2 and supervisor.processes["daq"].vitals.count > 0:
        supervisor.stop()
supervisor.run(turn)
print(*[event.pid for event in of_kind(events, "away", "started")])
print(of_kind(events, "daq", "stopped")[0].text)
"""
NO_RIGHT_TO_KILL = ("setpriv", "--bounding-set", "-kill", "--inh-caps", "-all")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can start a process of another user")
def test_a_child_that_cannot_be_killed_delays_nothing_and_is_not_started_beside_itself() -> None:
    # Another user's process, where one has no right to kill, outlives SIGKILL as one in a driver.
    done = subprocess.run(
        [*NO_RIGHT_TO_KILL, sys.executable, "-c", SUPERVISED, AWAY],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    started, last = done.stdout.strip().splitlines()
    (pid,) = map(int, started.split())
    os.kill(pid, signal.SIGKILL)
    assert last == "stopped"


def test_a_folder_of_configurations_that_does_not_answer_ends_no_rig(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [rig_file(tmp_path, name) for name in ("a", "b")]
    rigs = [(path, load_rig(path)) for path in paths]
    supervisor, told = Supervisor([], lambda _: None), list[str]()
    rig_set = RigSet(paths, rigs, (), supervisor, told.append)
    stat, began = Path.stat, time.monotonic()

    def stale(path: Path, **options: bool) -> os.stat_result:
        if path in paths:
            raise OSError(errno.ESTALE, os.strerror(errno.ESTALE))
        return stat(path, **options)

    monkeypatch.setattr(Path, "stat", stale)
    for seconds in (1.0, 2.0 + GONE_AFTER):
        monkeypatch.setattr(time, "monotonic", lambda now=began + seconds: now)
        rig_set.check()
    assert told == []
    assert list(rig_set._rigs) == paths
    supervisor._stop_all()
