"""Recorder, router and witness, which run for a year, keep their memory in few pools."""

import subprocess
import sys
from pathlib import Path

import pytest

from rigwatch.wire.host import few_pools
from tests.bus.rig import CONFIG

POOLS_OF_EIGHT_THREADS = """
import contextlib, ctypes, sys, threading
from pathlib import Path
from rigwatch import recorder, router, witness
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.rig_config import load_rig

stop = threading.Event()
with contextlib.suppress(RigwatchError):
    {begin}
barrier = threading.Barrier(9)

def work():
    held = [bytes(2000) for _ in range(100)]
    barrier.wait()
    barrier.wait()

for _ in range(8):
    threading.Thread(target=work).start()
barrier.wait()
c = ctypes.CDLL(None)
c.fopen.restype = ctypes.c_void_p
file = c.fopen(sys.argv[2].encode(), b"w")
c.malloc_info(0, ctypes.c_void_p(file))
c.fclose(ctypes.c_void_p(file))
barrier.wait()
"""
"""The beginning fails, as nothing is there to record or to supervise, but prepares the process."""


@pytest.mark.parametrize(
    "begin",
    [
        "recorder.run(Path('none.toml'), stop)",
        "recorder.run_several([Path('none.toml')], stop)",
        "witness.run(load_rig(sys.argv[1]), stop)",
        "router.run(load_rig(sys.argv[1]), stop)",
    ],
)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="pools are those of glibc")
def test_threads_share_few_pools(tmp_path: Path, begin: str) -> None:
    config, pools = tmp_path / "rig.toml", tmp_path / "pools.xml"
    text = CONFIG.format(router=1, listen=1, lease=1.0)
    config.write_text(text.replace("tcp/127.0.0.1:1", "nowhere"))
    code = POOLS_OF_EIGHT_THREADS.format(begin=begin)
    subprocess.run([sys.executable, "-c", code, str(config), str(pools)], check=True, timeout=60)
    assert 1 <= pools.read_text().count("<heap nr") <= few_pools.POOLS
