"""Recorder, router and witness begin with few objects that a collection of garbage looks at."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.bus.rig import TestRig

OBJECTS_LOOKED_AT = """
import gc, sys, threading, time
from pathlib import Path
from rigwatch import recorder, router, witness
from rigwatch.wire.rig_config import load_rig

stop = threading.Event()
process = threading.Thread(target=lambda: {begin})
process.start()
end = time.monotonic() + 30.0
while not gc.get_freeze_count() and time.monotonic() < end:
    time.sleep(0.05)
print(gc.get_freeze_count(), len(gc.get_objects()))
stop.set()
process.join()
"""


@pytest.mark.parametrize(
    "begin",
    [
        "recorder.run(Path(sys.argv[1]), stop)",
        "recorder.run_several([Path(sys.argv[1])], stop)",
        "witness.run(load_rig(sys.argv[1]), stop)",
        "router.run(load_rig(sys.argv[1]), stop)",
    ],
)
def test_what_start_up_made_is_not_looked_at_again(tmp_path: Path, begin: str) -> None:
    with TestRig(tmp_path) as rig:
        if "router" not in begin:
            rig.router()
        said = subprocess.run(
            [sys.executable, "-c", OBJECTS_LOOKED_AT.format(begin=begin), str(rig.path)],
            cwd=tmp_path, check=True, timeout=60, capture_output=True, text=True,
        )  # fmt: skip
    settled, looked_at = map(int, said.stdout.split())
    assert settled > 10_000
    assert looked_at < settled / 10
