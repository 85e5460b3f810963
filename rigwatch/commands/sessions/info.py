"""`rigwatch info`: summarises a session."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import damage_lines, print_result

if TYPE_CHECKING:
    from rigwatch.wire.messages import RunInfo
    from rigwatch.wire.session import ChannelSummary, DeviceSummary, Summary

HELP = "summarise a session: rates, gaps, quality, topics, alarms, damage"
EXAMPLE = "  rigwatch info sessions/bench1-20260501T120000Z"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("session", type=Path, help="session file or folder of segments")


def run(arguments: argparse.Namespace) -> int:
    """0 if the session is readable, damaged or not."""
    from rigwatch.wire.session import open_session, summarise

    summary = summarise(open_session(arguments.session))
    print_result(arguments, _as_data(summary), _lines(summary))
    return 0


def _as_data(summary: "Summary") -> dict[str, Any]:
    names = (name for name in summary.__slots__)
    return {"duration_s": summary.duration_s} | {name: getattr(summary, name) for name in names}


def _lines(summary: "Summary") -> list[str]:
    from rigwatch.wire.session import iso_time

    span = f"{iso_time(summary.start_ns)} … {iso_time(summary.end_ns)}"
    lines = [f"{summary.path}: {summary.segments} segment(s), {summary.duration_s:.3f} s, {span}"]
    lines += _run_lines(summary.run)
    for device in summary.devices:
        lines += _device_lines(device)
    counts = ", ".join(f"{name} {count}" for name, count in summary.topics.items())
    lines.append(f"messages: {counts}")
    lines += _alarm_lines(summary)
    if summary.unknown_ends:
        lines.append(f"the end of {summary.unknown_ends} start(s) is missing, length unknown")
    lines += [f"missing {topic}: {n}" for topic, n in summary.lost_messages.items() if n]
    lines += damage_lines(summary.lost)
    lines += [f"not closed (still recording, or killed): {name}" for name in summary.unclosed]
    return lines


def _alarm_lines(summary: "Summary") -> list[str]:
    """Every change of an alarm; its cause where it is raised."""
    from rigwatch.wire.session import iso_time

    lines, standing = [], set[str]()
    for alarm in summary.alarms:
        raised = alarm.state != "normal" and alarm.name not in standing
        cause = f": {alarm.cause}" if raised else ""
        lines.append(f"alarm: {iso_time(alarm.t_ns)} {alarm.name} {alarm.state}{cause}")
        (standing.discard if alarm.state == "normal" else standing.add)(alarm.name)
    return lines


def _run_lines(run: "RunInfo | None") -> list[str]:
    if run is None:
        return ["the description of the run is lost"]
    lines = [f"rig {run.rig}, nominal {run.sample_rate_hz:g} Hz, written by {run.software}"]
    return [*lines, f"notes: {run.notes}"] if run.notes else lines


def _device_lines(device: "DeviceSummary") -> list[str]:
    figures = (
        f"device {device.name}: {device.samples} samples at {_rate(device.rate_hz)}, "
        f"longest step {_step(device.longest_step_s)}, {device.boots} start(s), "
        f"{device.gaps} gap(s) with {device.missing} samples missing"
    )
    if device.clock_steps:
        figures += f", clock set {device.clock_steps} time(s)"
    return [figures, *(_channel_line(channel) for channel in device.channels)]


def _rate(rate_hz: float) -> str:
    """A rate; that of a slow log, of a sample a minute or a day, by its first digits."""
    return f"{rate_hz:.3f} Hz" if rate_hz >= 1 else f"{rate_hz:.4g} Hz"


def _step(step_s: float) -> str:
    return f"{step_s * 1e3:.3f} ms" if step_s < 1 else f"{step_s:.6g} s"


def _channel_line(channel: "ChannelSummary") -> str:
    flags = ", ".join(f"{name} {count}" for name, count in channel.flags.items())
    unit = f" {channel.unit}" if channel.unit else ""
    extent = f"{channel.low:.6g} … {channel.high:.6g}{unit}, mean {channel.mean:.6g}{unit}"
    return f"  {channel.name}: {extent}; {flags}"
