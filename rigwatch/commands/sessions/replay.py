"""`rigwatch replay`: runs the monitor over recordings."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import (
    POSITIVE,
    add_many,
    add_span,
    damage_lines,
    print_result,
    run_many,
    say,
    span_between,
    span_of,
    the_one,
)
from rigwatch.wire.errors import SessionError

if TYPE_CHECKING:
    from rigwatch.replay import Replay
    from rigwatch.wire.messages import Alarm

NEVER_ARMED = (
    "nothing was judged: the monitor was never armed; replay a longer recording of steady motion"
    " (it arms within two seconds of a motion that it knows, and learns others for some periods)"
)
HELP = "run the monitor over recordings, as fast as possible or at a given speed"
EXAMPLE = """\
  rigwatch replay run.mcap --model model.toml
  rigwatch replay sessions/bench1-20260501T120000Z --speed 1 --start 60
  rigwatch replay run.mcap --model model.toml --out judged.mcap --json
  rigwatch replay sessions 'more/*.mcap' --model model.toml --on local:4 --results judged.parquet"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_many(parser, "session", "session file or folder of segments")
    parser.add_argument("--model", type=Path, help="model file; default: the configuration's")
    parser.add_argument(
        "--config", type=Path, help="configuration of the rig; default: the one recorded with it"
    )
    parser.add_argument(
        "--speed", type=POSITIVE, default=0.0, metavar="X", help="multiple of real time"
    )
    parser.add_argument(
        "--out", type=Path, metavar="SESSION", help="new session of samples, estimates and alarms"
    )
    add_span(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if everything is judged, with or without alarms; 1 if some of several recordings failed."""
    path = the_one(arguments, arguments.session)
    return _run_many(arguments) if path is None else _run_one(arguments, path)


def _run_many(arguments: argparse.Namespace) -> int:
    from rigwatch.batch import Job

    if arguments.out is not None or arguments.speed:
        option = "--out" if arguments.out is not None else "--speed"
        raise SessionError(f"{option}: found several recordings, expected one")
    names = ("model", "config", "start", "end")
    settings = {name: getattr(arguments, name) for name in names}
    return run_many(arguments, arguments.session, Job("replay", judged), settings, line=_line)


def judged(
    path: Path, model: Path | None, config: Path | None, start: str | None, end: str | None
) -> dict[str, Any]:
    """The result of one of several recordings: as for one, without the time it took."""
    from rigwatch.replay import monitor_for, replay
    from rigwatch.wire.session import open_session

    session = open_session(path)
    monitor = monitor_for(session, model, config)
    found = _as_data(replay(session, monitor, span_between(start, end, session)), None)
    raised = _raised(found["alarms"])
    kept = ("samples", "armed", "duration_s", "alarms", "events", "lost")
    return {"raised": raised, "raised_count": len(raised)} | {name: found[name] for name in kept}


def _line(found: dict[str, Any]) -> str:
    lost = f"; {len(found['lost'])} damaged part(s)" if found["lost"] else ""
    size = f"{found['samples']} samples, {found['duration_s']:.1f} s"
    return f"{size}; {_alarms(found['raised'], found['armed'])}{lost}"


def _run_one(arguments: argparse.Namespace, path: Path) -> int:
    from rigwatch.replay import monitor_for, replay
    from rigwatch.wire.session import open_session

    session = open_session(path)
    monitor = monitor_for(session, arguments.model, arguments.config)
    span = span_of(arguments, session)
    announce = _ignore if arguments.json else Announcer()
    done = replay(session, monitor, span, speed=arguments.speed, out=arguments.out, say=announce)
    for line in damage_lines(done.lost):
        say(line)
    print_result(arguments, _as_data(done, arguments.out), _summary(done))
    return 0


def _ignore(_: "Alarm") -> None:
    """Print nothing: with --json all results come at the end."""


class Announcer:
    """Prints an alarm as it occurs, and again where its figure has become better."""

    def __init__(self) -> None:
        self._newest: dict[str, Alarm] = {}

    def __call__(self, alarm: "Alarm") -> None:
        """Print a line."""
        from rigwatch.wire.messages import told_again
        from rigwatch.wire.session import iso_time

        before = self._newest.get(alarm.name)
        self._newest[alarm.name] = alarm
        first = ", first" if alarm.first_out else ""
        again = ", told again" if before and told_again(before, alarm) else ""
        state = alarm.state.replace("_", " ")
        head = f"{iso_time(alarm.t_ns)}  {alarm.severity:8}  {alarm.name}: {state}{first}{again}"
        print(f"{head} ({alarm.cause})", flush=True)


def _raised(alarms: "list[Alarm]") -> list[str]:
    from rigwatch.wire.messages import transitions

    return [alarm.name for alarm in transitions(alarms) if alarm.state == "unacknowledged"]


def _summary(done: "Replay") -> str:
    raised = _raised(done.alarms)
    speed = f"{done.elapsed_s:.2f} s ({done.times_real_time:,.0f} × real time)"
    return (
        f"{done.samples} samples, {done.duration_s:.1f} s in {speed}; {_alarms(raised, done.armed)}"
    )


def _alarms(raised: list[str], armed: int) -> str:
    if raised:
        return f"alarms raised: {', '.join(raised)}"
    return "no alarm was raised" if armed else f"no alarm was raised, but {NEVER_ARMED}"


def _as_data(done: "Replay", out: Path | None) -> dict[str, Any]:
    return {
        "samples": done.samples,
        "armed": done.armed,
        "duration_s": done.duration_s,
        "elapsed_s": done.elapsed_s,
        "times_real_time": done.times_real_time,
        "alarms": done.alarms,
        "events": done.events,
        "lost": done.lost,
        "out": out,
    }
