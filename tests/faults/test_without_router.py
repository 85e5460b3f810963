"""Processes that wait for a router at their start say so, and end at once at a signal."""

import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from shutil import copy

import pytest

from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.host.ports import free_port
from rigwatch.wire.typed_files.shipped import find_config
from tests.waiting import eventually

MODEL = Path(__file__).parents[1] / "versions" / "2026-11-22" / "model.toml"
AT_ONCE = 2.0
"""Time to end, an attempt of the bus and the interpreter's own end included [s]."""


def alone(folder: Path) -> Path:
    """The demonstration's rig, on a bus that nobody serves."""
    copy(MODEL, folder)
    rig = write_rig_file(find_config("demo.toml"), folder, "web")
    rig.write_text(
        re.sub(r'"tcp/127.0.0.1:\d+"', f'"tcp/127.0.0.1:{free_port()}"', rig.read_text())
        + "\n[witness]\n"
    )
    return rig


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=["SIGTERM", "SIGINT"])
@pytest.mark.parametrize("process", ["daq", "monitor", "record", "witness", "dashboard"])
def test_a_process_that_waits_for_its_router_ends_at_once(
    process: str, number: signal.Signals, tmp_path: Path
) -> None:
    said: list[str] = []
    command = [sys.executable, "-m", "rigwatch", process, str(alone(tmp_path))]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as running:
        assert running.stdout is not None
        reader = threading.Thread(target=said.extend, args=(running.stdout,))
        reader.start()
        eventually(lambda: bool(said), "it says so")
        assert "no router answers" in said[0]
        asked = time.monotonic()
        running.send_signal(number)
        try:
            code = running.wait(timeout=10 * AT_ONCE)
        finally:
            running.kill()
        took = time.monotonic() - asked
        reader.join()
    assert code == 0, said
    assert took < AT_ONCE
    assert len(said) == 1, said
