"""How tests are handed out to workers, and how those that failed are found again."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tests.made_once import SHARED, made_once
from tools.failed_tests import failed_tests


@pytest.mark.xdist_group("one")
def test_tests_of_one_group_run_in_one_worker(request: pytest.FixtureRequest) -> None:
    assert group(request) == "one"


def test_without_a_group_those_of_a_file_run_in_one_worker(request: pytest.FixtureRequest) -> None:
    assert group(request) == "tests/tooling/test_test_runs.py"


def group(request: pytest.FixtureRequest) -> str:
    """What xdist hands out a test by.

    Without it, each test of a group or a file may set up its rig, its browser or its fit once more.
    """
    if request.config.getoption("loadgroup", False):
        return str(request.node.nodeid.rpartition("@")[2])
    marker = request.node.get_closest_marker("xdist_group")
    assert marker is not None
    return str(marker.args[0])


def test_what_workers_need_at_the_same_time_is_made_by_one_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SHARED, f"{tmp_path}")
    numbers = iter(range(4))

    def make() -> np.ndarray:
        return np.full(100_000, next(numbers))

    # Each worker decorates the function, and finds what it has found before in its own memory.
    workers = [made_once(make) for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda worker: worker(), workers))

    assert all(np.array_equal(one, found[0]) for one in found)
    assert next(numbers) == 1
    assert workers[0]() is found[0]


def test_what_fails_in_a_group_is_found_again(tmp_path: Path) -> None:
    (tmp_path / "test_some.py").write_text(
        "import pytest\n"
        '@pytest.mark.xdist_group("rig")\n'
        '@pytest.mark.parametrize("at", ["a@b", "c d"])\n'
        "def test_grouped(at): assert False\n"
        "def test_alone(): assert False\n"
        "def test_good(): pass\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", "--rootdir", "."]
    workers = ["-n", "2", "--dist", "loadgroup", "-o", f"cache_dir={tmp_path}/cache"]
    subprocess.run([*command, *workers], cwd=tmp_path, check=False)
    failed = failed_tests(tmp_path / "cache/v/cache/lastfailed")
    assert sorted(failed) == [
        "test_some.py::test_alone",
        "test_some.py::test_grouped[a@b]",
        "test_some.py::test_grouped[c d]",
    ]
    (tmp_path / "failed").write_text("\n".join(failed) + "\n")
    again = subprocess.run(
        [*command, "@failed"], cwd=tmp_path, check=False, capture_output=True, text=True
    )
    assert "3 failed" in again.stdout
    assert failed_tests(tmp_path / "none") == []
