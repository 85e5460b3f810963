"""Keeps files that this version has written, which all later versions have to read.

`python -m tools.keep_version` runs the demonstration, about two minutes; with the folder of one
that this version has run, it takes that. `formats` tells when it is to be run again.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from tools.keep_version.keeping import VERSIONS, keep


def main() -> int:
    """0 if the files are kept."""
    if sys.argv[1:]:
        print(keep(Path(sys.argv[1]), VERSIONS))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "rigwatch", "demo", "--headless", "--folder", folder]
        done = subprocess.run(words, check=False)
        if done.returncode == 0:
            print(keep(Path(folder), VERSIONS))
        return done.returncode


if __name__ == "__main__":
    sys.exit(main())
