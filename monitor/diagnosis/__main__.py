"""`python -m monitor.diagnosis FOLDER` ranks the request in a folder; the monitor starts it."""

import sys

from monitor.diagnosis.ranking_job import main

if __name__ == "__main__":
    sys.exit(main())
