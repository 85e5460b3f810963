"""`python -m rigwatch.recorder CONFIG`: the recording process by itself."""

import signal
import sys
import threading

from rigwatch.recorder.process import run
from rigwatch.wire.errors import RigwatchError

if __name__ == "__main__":
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        run(sys.argv[1], stop)
    except RigwatchError as error:
        sys.exit(f"recorder: {error}")
