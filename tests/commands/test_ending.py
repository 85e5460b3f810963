"""A signal ends a process wherever it comes, and also where nobody is left to kill it."""

import os
import subprocess
import sys

import pytest

from tests.waiting import eventually, runs

AT_EVERY_LINE = """
import signal, sys, threading
from rigwatch.wire.host.ending import set_at_hangup, set_at_signal

stop = {event}()

def interrupt(frame, event, _):
    if frame.f_code.co_filename != threading.__file__:
        return None
    if event == "line" and frame.f_code.co_name != "set":
        signal.raise_signal(signal.{number})
    return interrupt

sys.settrace(interrupt)
stop.wait(0.001)
sys.settrace(None)
sys.exit(0 if stop.wait(10) else "the event was not set")
"""
HANGS_AT_ITS_END = """
import os, time
from rigwatch.wire.host import ending

ending.PATIENCE = 0.1
ending.set_at_signal()
print(os.getpid(), flush=True)
while True:
    time.sleep(1)
"""
SUPERVISOR = f"""
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", {HANGS_AT_ITS_END!r}], stdout=subprocess.PIPE)
print(child.stdout.readline().decode(), flush=True)
os._exit(0)
"""


@pytest.mark.parametrize(
    ("event", "number"), [("set_at_signal", "SIGTERM"), ("set_at_hangup", "SIGHUP")]
)
def test_a_signal_amid_the_wait_for_its_event_ends_the_wait(event: str, number: str) -> None:
    code = AT_EVERY_LINE.format(event=event, number=number)
    subprocess.run([sys.executable, "-c", code], check=True, timeout=30)


def test_a_process_that_hangs_at_its_end_kills_itself_once_its_supervisor_is_gone() -> None:
    supervised = os.environ | {"NOTIFY_SOCKET": "@nobody"}
    run = [sys.executable, "-c", SUPERVISOR]
    pid = int(subprocess.run(run, env=supervised, stdout=subprocess.PIPE, check=True).stdout)
    os.kill(pid, 15)
    eventually(lambda: not runs(pid), "the orphan has ended")
