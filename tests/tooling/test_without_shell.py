"""A rig runs where there is no shell: whoever gets into a process finds none to go on with."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.session import open_session
from rigwatch.wire.typed_files.shipped import find_config
from tests.tooling.test_up import Rig, on_a_port_of_its_own

pytestmark = pytest.mark.xdist_group("rig")
SHELLS = ("sh", "bash", "dash", "ash", "zsh", "ksh", "busybox")
APART = ("unshare", "--map-root-user", "--mount")
RUNS_NO_SHELL = ("python", "-c", "import os, sys; sys.exit(os.system('true') == 0)")


def without_shells() -> tuple[str, ...]:
    """The beginning of a command that runs where no shell of this machine can be executed."""
    found = {os.path.realpath(path) for name in SHELLS if (path := shutil.which(name))}
    # The shell that hides the shells runs on until it has become the command.
    hide = "; ".join(f"mount --bind /dev/null {path}" for path in sorted(found))
    return (*APART, "sh", "-ec", f'{hide}; exec "$@"', "sh")


def test_a_rig_runs_and_records_where_there_is_no_shell(tmp_path: Path) -> None:
    hidden = without_shells()
    if not shutil.which("unshare") or subprocess.run([*APART, "true"], check=False).returncode:
        pytest.skip("no mounts of one's own here")
    subprocess.run([*hidden, *RUNS_NO_SHELL], check=True, timeout=60)
    path = on_a_port_of_its_own(write_rig_file(find_config("demo.toml"), tmp_path, "web"))
    rig = Rig(path, "--without", "monitor", "--without", "dashboard", before=hidden)
    try:
        rig.flows("recorder")
    finally:
        assert rig.end() == 0
    (session,) = (tmp_path / "sessions").glob("*Z*")
    assert sum(len(block) for block in open_session(session).samples()) > 0
