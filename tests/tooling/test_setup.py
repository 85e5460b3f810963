"""Lock files and set-up scripts."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOCKS = sorted((ROOT / "requirements").glob("*.txt"))
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")


def pins(lock: Path) -> dict[str, tuple[str, int]]:
    """Version and number of hashes of each package in a lock file."""
    text = lock.read_text(encoding="utf-8")
    entries = re.split(r"^(?=[a-z0-9])", text, flags=re.MULTILINE | re.IGNORECASE)[1:]
    found = {}
    for entry in entries:
        name, _, version = entry.split(maxsplit=1)[0].partition("==")
        found[name.lower().replace("_", "-")] = (version, len(HASH.findall(entry)))
    return found


def names(requirements: list[str]) -> set[str]:
    found = (re.match(r"[A-Za-z0-9._-]+", text) for text in requirements)
    return {match.group().lower().replace("_", "-") for match in found if match}


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.stem)
def test_every_package_is_pinned_with_hashes_and_no_index_is_named(lock: Path) -> None:
    assert pins(lock)
    for name, (version, hashes) in pins(lock).items():
        assert re.fullmatch(r"[0-9][\w.]*", version), name
        assert hashes >= 1, name
    text = lock.read_text(encoding="utf-8")
    assert not re.search(r"://|^\s*-(-index|-extra-index|-find-links|i |f )", text, re.MULTILINE)


def test_compiled_packages_carry_the_hashes_of_all_platforms() -> None:
    found = pins(ROOT / "requirements" / "lock.txt")
    for name in ("numpy", "numba", "scipy", "zstandard", "pyarrow"):
        assert found[name][1] >= 10, name


def test_lock_files_agree_with_each_other() -> None:
    versions: dict[str, str] = {}
    for lock in LOCKS:
        for name, (version, _) in pins(lock).items():
            assert versions.setdefault(name, version) == version, f"{name} in {lock.name}"


def test_what_the_project_asks_for_is_locked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    offline = names([*extras.pop("notebook"), *extras.pop("archive"), *extras.pop("dask")])
    locked = pins(ROOT / "requirements" / "lock.txt")
    asked = [text for extra in extras.values() for text in extra]
    assert names(project["dependencies"] + asked) <= locked.keys()
    # A rig needs no notebook and no archive: their packages are those of the tests.
    parts = [pins(ROOT / "requirements" / f"{part}.txt").keys() for part in ("lock", "dev")]
    assert offline <= parts[0] | parts[1]
    for part in ("build", "dev", "bench"):
        lines = (ROOT / "requirements" / f"{part}.in").read_text(encoding="utf-8").splitlines()
        asked = [line for line in lines if line and not line.startswith(("#", "-"))]
        assert names(asked) <= pins(ROOT / "requirements" / f"{part}.txt").keys()


@pytest.fixture
def bare_path(tmp_path: Path) -> Path:
    """A PATH with a shell's tools, and a Python that is too old."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in ("sh", "dirname", "grep", "sed", "tr", "id", "env", "flock"):
        found = shutil.which(tool)
        assert found is not None
        (folder / tool).symlink_to(found)
    script(folder / "python3", 'if [ "$1" = --version ]; then echo Python 3.9.2; else exit 1; fi')
    return folder


def script(path: Path, text: str) -> None:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def run_tool(name: str, *words: str, path: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [str(ROOT / "tools" / name), *words],
        env={"PATH": str(path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_without_a_suitable_python_the_suitable_ones_are_named(
    bare_path: Path, tmp_path: Path
) -> None:
    done = run_tool("setup.sh", str(tmp_path / "venv"), "requirements/lock.txt", path=bare_path)
    assert done.returncode == 1
    assert "found Python 3.9.2, expected Python 3.11, 3.12, 3.13 or 3.14" in done.stderr
    assert not (tmp_path / "venv").exists()


@pytest.fixture
def environment(bare_path: Path, tmp_path: Path) -> Path:
    """An environment with a pip that takes the packages of a lock file, but no refused one."""
    found = shutil.which("cat")
    assert found is not None
    (bare_path / "cat").symlink_to(found)
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    script(
        tmp_path / "venv" / "bin" / "python",
        """for last in "$@"; do :; done
[ -f "$last" ] || exit 0
sed -n -e 's,^package1.*,Processing ./& (from -r lock.txt (line 1)),p' \
    -e 's/^package[02-9].*/Collecting & (from -r lock.txt (line 1))/p' "$last"
if grep -q refused "$last"; then echo 'ERROR: wrong hash' >&2; exit 1; fi
echo 'Installing collected packages: all'""",
    )
    return tmp_path / "venv"


def test_the_set_up_says_how_far_it_is(environment: Path, bare_path: Path, tmp_path: Path) -> None:
    lock = tmp_path / "lock.txt"
    lock.write_text("".join(f"package{n}==1\n    --hash=sha256:0\n" for n in range(25)))
    done = run_tool("setup.sh", str(environment), str(lock), str(lock), path=bare_path)
    first, *rest = done.stdout.splitlines()
    assert first == f"setup: 25 packages to run rigwatch ({lock})"
    assert [line.split(":")[1].split()[0] for line in rest[:3]] == ["10", "20", "all"]
    assert rest[3:] == [first, *rest[:3]]
    assert (done.returncode, done.stderr) == (0, "")


def test_packages_that_are_there_already_are_not_counted_again(
    environment: Path, bare_path: Path, tmp_path: Path
) -> None:
    packages = environment / "lib" / "python3.11" / "site-packages"
    for there in ("Package_0-1", "package1-0.9", "package2-1"):
        (packages / f"{there}.dist-info").mkdir(parents=True)
    lock = tmp_path / "dev.txt"
    names = ("package-0", "package1", "package2", "package22")
    lock.write_text("".join(f"{name}==1 \\\n    --hash=sha256:0\n" for name in names))
    done = run_tool("setup.sh", str(environment), str(lock), path=bare_path)
    # Of package1 another version is there.
    assert done.stdout.splitlines()[0] == f"setup: 2 packages to check rigwatch ({lock})"


def test_only_the_lock_of_the_project_puts_the_project_in_and_is_compiled_as_a_whole(
    environment: Path, bare_path: Path
) -> None:
    python, told = environment / "bin" / "python", environment / "told"
    script(python, f'echo "$*" >> {told}; exit 0')
    for lock, wanted in (("dev.txt", False), ("lock.txt", True)):
        told.write_text("")
        done = run_tool("setup.sh", str(environment), f"requirements/{lock}", path=bare_path)
        assert done.returncode == 0, done.stderr
        assert (" --editable ." in told.read_text()) == wanted
        assert ("-m compileall " in told.read_text()) == wanted


def test_a_set_up_that_fails_says_why_and_ends_with_an_error(
    environment: Path, bare_path: Path, tmp_path: Path
) -> None:
    lock = tmp_path / "lock.txt"
    lock.write_text("refused==1\n")
    done = run_tool("setup.sh", str(environment), str(lock), path=bare_path)
    assert done.returncode != 0
    assert done.stderr == "ERROR: wrong hash\n"


def test_missing_debian_packages_are_reported_with_the_one_command_that_installs_them(
    bare_path: Path,
) -> None:
    script(bare_path / "dpkg-query", "echo unknown ok not-installed")
    script(bare_path / "apt-get", "exit 1")
    (bare_path / "id").unlink()
    script(bare_path / "id", "echo 1000")
    command = "sudo apt-get install --yes --no-install-recommends libone libtwo"
    done = run_tool("debian_packages.sh", "libone", "libtwo", path=bare_path)
    assert done.returncode == 1
    assert command in done.stderr
    wished = run_tool("debian_packages.sh", "--wish", "libone", "libtwo", path=bare_path)
    assert wished.returncode == 0
    assert command in wished.stderr


def test_debian_packages_that_are_there_are_left_alone(bare_path: Path) -> None:
    script(bare_path / "dpkg-query", "echo install ok installed")
    done = run_tool("debian_packages.sh", "libone", path=bare_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_debian_packages_are_installed_where_that_is_allowed(
    bare_path: Path, tmp_path: Path
) -> None:
    called = tmp_path / "called"
    script(bare_path / "dpkg-query", "exit 1")
    script(bare_path / "apt-get", f'echo "$@" >> {called}')
    (bare_path / "id").unlink()
    script(bare_path / "id", "echo 0")
    done = run_tool("debian_packages.sh", "libone", path=bare_path)
    assert done.returncode == 0
    assert called.read_text().split()[0] == "install"
    assert called.read_text().split()[-1] == "libone"
