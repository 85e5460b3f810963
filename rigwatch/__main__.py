"""`python -m rigwatch` is the command line."""

import sys

from rigwatch.commands import main

if __name__ == "__main__":
    sys.exit(main())
