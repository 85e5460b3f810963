"""How tests are handed out to workers, and how those that failed are found again."""

import subprocess
import sys
from pathlib import Path

import pytest

from tools.failed_tests import failed_tests


@pytest.mark.xdist_group("one")
def test_tests_of_one_group_run_in_one_worker(request: pytest.FixtureRequest) -> None:
    # xdist hands out tests by what it appends to their names; without it, each test of a group
    # may set up its rig or its browser once more, beside the others.
    if not request.config.getoption("loadgroup", False):
        pytest.skip("one process runs all tests")
    assert request.node.nodeid.endswith("@one")


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
