"""The container image: what is collected for it, and that a rig runs where nothing else is."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.session import open_session
from rigwatch.wire.typed_files.shipped import find_config
from tests.tooling.test_up import Rig, on_a_port_of_its_own
from tools.image.collect import collect, place_libraries
from tools.image.tree import Tree

pytestmark = pytest.mark.xdist_group("rig")
ROOT = Path(__file__).parents[2]
APART = ("unshare", "--map-root-user", "--mount")
PYTHON = f"python3.{sys.version_info.minor}"
LOOKS_ROUND = """
import os, sqlite3, socket, ssl, zoneinfo
assert os.system("true") != 0
assert socket.gethostbyname("localhost") == "127.0.0.1"
assert zoneinfo.ZoneInfo("Europe/Berlin")
assert ssl.get_default_verify_paths().capath or ssl.get_default_verify_paths().cafile
print(*(os.path.join(at, name) for at, _, names in os.walk("/") for name in names
        if not at.startswith(("/proc", "/dev", "/sys")) and name in ("sh", "bash", "pip", "perl")))
"""


class Image:
    """The collected image, with this machine's devices, and the folders that a container mounts."""

    def __init__(self, root: Path, *mounted: Path) -> None:
        self.root = root
        mounts = [f'mount --rbind {path} "$0{path}"' for path in ("/dev", "/proc", *mounted)]
        for path in ("/dev", "/proc", *map(str, mounted)):
            (root / path[1:]).mkdir(parents=True, exist_ok=True)
        script = "; ".join([*mounts, f'exec unshare --root="$0" --wd={ROOT} "$@"'])
        # The shell ends outside: it becomes the command.
        self.inside = (*APART, "sh", "-ec", script, str(root))

    def run(self, *words: str) -> str:
        command = [*self.inside, *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1200)
        assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
        return done.stdout


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Image]:
    """The image of this checkout's own environment, whose rigwatch is the source beside it."""
    if not shutil.which("unshare") or subprocess.run([*APART, "true"], check=False).returncode:
        pytest.skip("no mounts of one's own here")
    folder = tmp_path_factory.mktemp("image")
    kernels = Path(os.environ.get("NUMBA_CACHE_DIR", folder / "kernels")).absolute()
    kernels.mkdir(exist_ok=True)
    (folder / "mounted").mkdir()
    lock = ROOT / "requirements" / "lock.txt"
    sources = (ROOT / name for name in ("rigwatch", "daq", "monitor", "sim_plant", "configs"))
    tree = collect(Path(sys.prefix), folder / "root", lock, *sources)
    yield Image(tree.root, folder / "mounted", kernels)
    shutil.rmtree(tree.root)


def recorded_samples(folder: Path) -> int:
    (session,) = (folder / "sessions").glob("*Z*")
    return sum(len(block) for block in open_session(session).samples())


@pytest.mark.nightly
def test_a_rig_runs_and_records_where_python_is_the_only_program(image: Image) -> None:
    folder = image.root.parent / "mounted"
    assert image.run(str(Path(sys.prefix) / "bin" / "python"), "-c", LOOKS_ROUND).strip() == ""
    path = on_a_port_of_its_own(write_rig_file(find_config("demo.toml"), folder, "web"))
    rig = Rig(path, "--without", "monitor", "--without", "dashboard", before=image.inside)
    try:
        rig.flows("recorder")
    finally:
        assert rig.end() == 0
    assert recorded_samples(folder) > 0


@pytest.mark.nightly
def test_every_process_of_a_commissioned_rig_answers_in_the_image(image: Image) -> None:
    folder = image.root.parent / "mounted" / "whole"
    command = (str(Path(sys.prefix) / "bin" / "python"), "-m", "rigwatch")
    image.run(*command, "demo", "--commission-only", "--folder", str(folder))
    path = on_a_port_of_its_own(write_rig_file(find_config("demo.toml"), folder, "web"))
    assert "fail" not in image.run(*command, "doctor")
    rig = Rig(path, before=image.inside)
    try:
        for process in ("recorder", "monitor", "dashboard"):
            rig.flows(process, 100.0)
        for process in ("router", "plant", "daq", "monitor", "recorder", "dashboard"):
            assert image.run(*command, "doctor", str(path), "--alive", process).startswith("ok")
    finally:
        assert rig.end() == 0
    assert recorded_samples(folder) > 0


def test_a_program_that_is_not_on_the_list_is_noticed(tmp_path: Path) -> None:
    tree = Tree(tmp_path / "root")
    shell = tree.place(Path("/bin/sh"))
    library = tree.place(Path(os.__file__))
    assert place_libraries(tree) == [shell]
    assert tree.within(library).is_file()
    # The shell runs there: its loader and libraries have been placed with it.
    places = {path.name for path in tree.files}
    assert "libc.so.6" in places
    assert any(name.startswith("ld-") for name in places)


def test_links_on_the_way_are_placed_and_what_is_not_wanted_is_left_out(tmp_path: Path) -> None:
    real = tmp_path / "real" / "deep"
    real.mkdir(parents=True)
    for name in ("wanted", "unwanted"):
        (real / name).write_text(name)
    (tmp_path / "far").symlink_to("real/deep/../deep")
    (real / "again").symlink_to(tmp_path / "far" / "wanted")
    tree = Tree(tmp_path / "root")
    tree.place(tmp_path / "far", lambda path: path.name != "unwanted")
    placed = tree.within(tmp_path)
    assert (placed / "far").readlink() == Path("real/deep/../deep")
    assert sorted(path.name for path in (placed / "far").iterdir()) == ["again", "wanted"]
    assert tree.files == [real / "wanted"]
    with pytest.raises(FileExistsError, match="is not empty"):
        Tree(tmp_path / "root")
