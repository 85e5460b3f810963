"""`python -m rigwatch.recorder CONFIG`: runs the recording process."""

import sys

from rigwatch.recorder.process import run
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import set_at_signal

if __name__ == "__main__":
    stop = set_at_signal()
    try:
        run(sys.argv[1], stop)
    except RigwatchError as error:
        sys.exit(f"recorder: {error}")
