"""`python -m monitor CONFIG` runs the monitor of a rig; `rigwatch monitor` does the same."""

import sys

from monitor.process import run
from rigwatch.wire.errors import RigwatchError

if __name__ == "__main__":
    try:
        sys.exit(run(sys.argv[1]))
    except RigwatchError as error:
        sys.exit(f"monitor: {error}")
