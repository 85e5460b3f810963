"""`python -m monitor.diagnosis` ranks the request at its input; the monitor starts it."""

import sys

from monitor.diagnosis.ranking_job import main

if __name__ == "__main__":
    sys.exit(main())
