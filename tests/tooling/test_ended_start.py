"""A process that is asked to end while it compiles does so at once, as at any other time."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.host import unless_ended
from tests.faults.test_without_router import AT_ONCE, alone
from tests.waiting import eventually

LONG = """
import time
from rigwatch.wire.host import set_at_signal, unless_ended
stop = set_at_signal()
print("begins", flush=True)
unless_ended(stop, lambda: time.sleep(600))
"""


@pytest.mark.parametrize("process", ["daq", "monitor", "plant"])
def test_64_a_process_that_compiles_ends_at_once(process: str, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    command = [sys.executable, "-m", "rigwatch", process, str(alone(tmp_path))]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as running:
        try:
            eventually(lambda: any(cache.rglob("*.nbi")), "the first kernel")
            running.send_signal(signal.SIGTERM)
            assert running.wait(AT_ONCE) == 0
        finally:
            running.kill()
        assert running.stdout is not None
        assert running.stdout.read() == b""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_work_that_nothing_interrupts_is_left_behind(number: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE) as running:
        try:
            assert running.stdout is not None
            assert running.stdout.readline() == b"begins\n"
            running.send_signal(number)
            assert running.wait(AT_ONCE) == 0
        finally:
            running.kill()


def test_what_the_work_returns_or_raises_is_passed_on() -> None:
    stop = threading.Event()
    assert unless_ended(stop, lambda: 3) == 3

    def wrong() -> None:
        raise ConfigError("rig.toml", "rig", "nothing", "a rig")

    with pytest.raises(ConfigError, match=r"rig\.toml"):
        unless_ended(stop, wrong)
