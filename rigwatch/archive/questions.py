"""Questions that people ask of an archive, by name."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Question:
    """A named query.

    Attributes:
        text: what it answers.
        sql: with the parameters $rig (a pattern, ! before what is literal), $since and $until; or,
            if it counts back, $names (the rigs), $ends (of each, where its time ends), and the
            $first and $last of these.
    """

    text: str
    sql: str


COUNTS_BACK = "$ends"
"""In the SQL of a question about the time before an end, for which one far off will not do."""
_OF_RIG = "rig like $rig escape '!'"
_IN_SPAN = f"{_OF_RIG} and time >= $since and time < $until"
_RECORDED = f'{_OF_RIG} and "end" >= $since and start < $until'
_SOUND = "status <> 'duplicate'"
# The days are compared with constants too: the engine skips the files of the others.
_LEVEL = """
    select rig, unit, sum(mean * count) / sum(count) as level, count(*) / 3600 as hours
    from seconds join ends using (rig)
    where name = 'theta1'
      and day between ($first - interval {first} day)::date and ($last - interval {last} day)::date
      and second >= until - interval {first} day and second < until - interval {last} day
    group by rig, unit
"""

QUESTIONS: dict[str, Question] = {
    "friction-growth": Question(
        "whose Coulomb friction (theta1) grew in the 30 days before --until, or its newest session",
        "with ends as (select unnest($names::varchar[]) as rig, "
        f"unnest({COUNTS_BACK}::timestamp[]) as until), "
        f"now as ({_LEVEL.format(first=30, last=0)}), "
        f"before as ({_LEVEL.format(first=60, last=30)}) "
        "select rig, unit, before.level as before, now.level as now, "
        "now.level - before.level as growth, before.hours as hours_before, now.hours as hours_now "
        "from now join before using (rig, unit) order by growth desc",
    ),
    "alarms": Question(
        "which alarms a rig had, in order of time",
        "select rig, time, name, severity, cause, session from alarms "
        f"where state = 'unacknowledged' and {_IN_SPAN} order by rig, time",
    ),
    "alarm-counts": Question(
        "how often each alarm of each rig was raised",
        "select rig, name, count(*) as raised, min(time) as first, max(time) as last from alarms "
        f"where state = 'unacknowledged' and {_IN_SPAN} "
        "group by rig, name order by raised desc, rig, name",
    ),
    "losses": Question(
        "where samples were lost: sessions with missing samples, gaps or damage",
        "select rig, session, start, duration_s, samples, missing, gaps, damaged_bytes, remark "
        f"from sessions where {_RECORDED} and {_SOUND} "
        "and (missing > 0 or gaps > 0 or damaged_bytes > 0) order by missing desc, session",
    ),
    "loss-times": Question(
        "when samples, messages or bytes were lost, and why",
        "select rig, time, what, count, reason, session from losses "
        f"where {_IN_SPAN} order by rig, time",
    ),
    "unsound": Question(
        "sessions that are damaged, unfinished, unreadable or copies",
        "select session, status, remark from sessions where status not in ('ok', 'thinned') "
        "order by session",
    ),
    "overlaps": Question(
        "sessions of one rig that overlap in time: clocks or recorders that disagree",
        "select a.rig, a.session, b.session as other, "
        'epoch(least(a."end", b."end") - b.start) as seconds '
        "from sessions a join sessions b on a.rig = b.rig and a.session <> b.session "
        'and a.start <= b.start and b.start < a."end" '
        "and (a.start < b.start or a.session < b.session) "
        f"where a.{_OF_RIG} and a.{_SOUND} and b.{_SOUND} order by a.rig, b.start, a.session",
    ),
    "rigs": Question(
        "recorded hours, quality, losses and alarms of each rig",
        'select rig, count(*) as sessions, min(start) as first, max("end") as last, '
        "sum(duration_s) / 3600 as hours, sum(missing) as missing, "
        "sum(good * samples) / sum(samples) as good, sum(len(raised)) as alarms "
        f"from sessions where {_RECORDED} and {_SOUND} group by rig order by rig",
    ),
}
