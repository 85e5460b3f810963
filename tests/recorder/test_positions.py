"""Positions are saved in place; a save that is cut short at any byte leaves the one before it."""

import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.recorder.positions import HALF, PositionFile, Positions, load_positions

SAVING = """
import resource, sys
from pathlib import Path
from rigwatch.recorder.positions import PositionFile
file = PositionFile(Path(sys.argv[1]))
for number in range(int(sys.argv[2]), 1 << 40):
    file.save({topic: {"monitor": (7, number)} for topic in ("alarms", "estimates")})
    print(number, flush=True)
"""


def at(number: int) -> Positions:
    return {"alarms": {"monitor": (7, number)}}


def saved(folder: Path, *numbers: int) -> bytes:
    file = PositionFile(folder)
    for number in numbers:
        file.save(at(number))
    return (folder / "positions").read_bytes()


def test_a_recorder_killed_at_any_moment_goes_on_from_its_last_save(tmp_path: Path) -> None:
    number = 0
    for round_ in range(8):
        command = [sys.executable, "-c", SAVING, str(tmp_path), str(number)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            said = [int(child.stdout.readline()) for _ in range(1 + 97 * round_)]
            child.send_signal(signal.SIGKILL)
            said += [int(line) for line in child.stdout if line.endswith("\n")]
        found = {place["monitor"] for place in load_positions(tmp_path).values()}
        assert len(found) == 1, "all of one save"
        number = found.pop()[1]
        assert number in (said[-1], said[-1] + 1)


@pytest.mark.parametrize("before", [(1,), (1, 2), (1, 2, 3)])
def test_a_save_torn_at_any_byte_leaves_the_one_before(
    tmp_path: Path, before: tuple[int, ...]
) -> None:
    old = saved(tmp_path, *before)
    new = saved(tmp_path, before[-1] + 1)
    old = old.ljust(len(new), b"\0")
    changed = [place for place in range(len(new)) if new[place] != old[place]]
    for cut in range(changed[0], changed[-1] + 1):
        (tmp_path / "positions").write_bytes(new[:cut] + old[cut:])
        assert load_positions(tmp_path) == at(before[-1])


@pytest.fixture
def full_disk() -> Iterator[None]:
    """No file may grow beyond some bytes of its second half, as on a disk that fills up."""
    kept = resource.getrlimit(resource.RLIMIT_FSIZE)
    handled = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (HALF + 20, kept[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, kept)
    signal.signal(signal.SIGXFSZ, handled)


def test_on_a_full_disk_the_last_whole_save_stays(tmp_path: Path, full_disk: None) -> None:
    data = saved(tmp_path, 1, 2, 3, 4)
    assert len(data) == HALF + 20, "the second half is torn"
    assert load_positions(tmp_path) == at(1)


def test_one_started_again_keeps_the_save_before_its_first(tmp_path: Path) -> None:
    saved(tmp_path, 1, 2, 3)
    assert b"[7,3]" in saved(tmp_path, 4)


def test_the_file_of_an_earlier_version_is_read_until_the_first_save(tmp_path: Path) -> None:
    (tmp_path / "positions.json").write_text('{"alarms":{"monitor":[7,3]}}')
    assert load_positions(tmp_path) == at(3)
    saved(tmp_path, 4)
    assert load_positions(tmp_path) == at(4)


@pytest.mark.parametrize("content", [b"", b"\0" * 4096, b"\xff" * (2 * HALF), b'{"alarms":{}}'])
def test_a_file_of_something_else_is_no_position(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "positions").write_bytes(content)
    assert load_positions(tmp_path) == {}
    saved(tmp_path, 1)
    assert load_positions(tmp_path) == at(1)
