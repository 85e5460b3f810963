"""The page of many rigs outlasts a full disk, here a limit on the size of files."""

import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigwatch.commands import EXIT_ERROR, main
from tests.bus.rig import kill
from tests.monitor_process.test_several import rig_file
from tests.recorder.full_disk import largest_file
from tests.waiting import eventually


@contextmanager
def following(config: Path, page: Path) -> Iterator[tuple[int, Path]]:
    """`rigwatch fleet --page --follow`: the process, and what it says."""
    said = page.with_suffix(".err")
    words = ["fleet", str(config), "--timeout", "0.1", "--page", str(page), "--follow"]
    with said.open("wb") as output:
        process = subprocess.Popen([sys.executable, "-m", "rigwatch", *words], stderr=output)
    try:
        yield process.pid, said
        assert process.poll() is None, said.read_text()
    finally:
        kill(process)


def written(page: Path) -> int:
    return page.stat().st_mtime_ns if page.exists() else 0


def test_a_page_that_follows_goes_on_after_a_full_disk(tmp_path: Path) -> None:
    page = tmp_path / "fleet.html"
    with following(rig_file(tmp_path, "away"), page) as (process, said):
        eventually(page.exists, "the page")
        limits = resource.prlimit(process, resource.RLIMIT_FSIZE)
        resource.prlimit(process, resource.RLIMIT_FSIZE, (1000, limits[1]))
        eventually(lambda: "tried again" in said.read_text(), "what is wrong")
        before, whole = written(page), page.read_text()
        assert whole.rstrip().endswith("</html>")
        resource.prlimit(process, resource.RLIMIT_FSIZE, limits)
        eventually(lambda: written(page) > before, "the page again")
        eventually(lambda: "is written again" in said.read_text(), "that it is well")
    lines = said.read_text().splitlines()
    assert [line.partition(": ")[2].partition(": ")[0] for line in lines] == [str(page)] * 2
    assert list(tmp_path.glob("*.part")) == []


def test_a_page_that_is_written_once_says_why_it_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, config = tmp_path / "fleet.html", rig_file(tmp_path, "away")
    with largest_file(1000):
        assert main(["fleet", str(config), "--timeout", "0.1", "--page", str(page)]) == EXIT_ERROR
    assert f"{page}: cannot be written" in capsys.readouterr().err
    assert not page.exists()
