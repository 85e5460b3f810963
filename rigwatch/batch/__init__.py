"""Work over many recordings or studies on any `concurrent.futures.Executor`.

`map_recordings` (`rigwatch.map`) runs a job on each of them: results go to a file as they come, a
run that was stopped continues, a worker that dies costs its unit a retry, and the final file
depends neither on the executor nor on the order or number of workers. `executor_on` turns a text
such as "local:4" into an executor, `expand` turns paths, globs and folders into units.
"""

from rigwatch.batch.executors import executor_on
from rigwatch.batch.expand import expand, is_address, recording_at
from rigwatch.batch.job import Job, Outcome, content_hash, job_of
from rigwatch.batch.mapping import Results, map_recordings, map_units

__all__ = [
    "Job",
    "Outcome",
    "Results",
    "content_hash",
    "executor_on",
    "expand",
    "is_address",
    "job_of",
    "map_recordings",
    "map_units",
    "recording_at",
]
