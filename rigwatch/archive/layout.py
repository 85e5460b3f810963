"""Where the index lies in an archive.

rigwatch-index/sessions.parquet                                 a row per session
rigwatch-index/alarms.parquet                                   a row per transition of an alarm
rigwatch-index/losses.parquet                                   a row per loss
rigwatch-index/seconds/rig=<rig>/day=<day>/<hash>.parquet       figures per second
"""

INDEX = "rigwatch-index"
SESSIONS = f"{INDEX}/sessions.parquet"
ALARMS = f"{INDEX}/alarms.parquet"
LOSSES = f"{INDEX}/losses.parquet"
SECONDS = f"{INDEX}/seconds"
