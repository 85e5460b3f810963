"""`rigwatch archive retain`: removes old sessions; those with alarms stay longer."""

import argparse
from typing import TYPE_CHECKING

from rigwatch.commands.archive.archive_text import table
from rigwatch.commands.common import number, print_result, say
from rigwatch.wire.errors import ArchiveError

if TYPE_CHECKING:
    from rigwatch.archive import Retained
    from rigwatch.wire.rig_config import RecorderSection

HELP = "list the sessions beyond limits of age or size; remove them with --remove"
EXAMPLE = """\
  rigwatch archive retain sessions --keep-days 90 --keep-alarm-days 730
  rigwatch archive retain sessions --keep-days 90 --keep-alarm-days 730 --remove
  rigwatch archive retain sessions --keep-days 90 --keep-seconds --remove
  rigwatch archive retain s3://recordings/rigs --rig bench1 --keep-gigabytes 500 --remove"""
EXIT_FAILED = 1
_LIMITS = {
    "keep_days": "age at which sessions are removed [days]",
    "keep_alarm_days": "the same for sessions with alarms [days]",
    "keep_gigabytes": "size of a rig's sessions above which the oldest are removed",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("url", metavar="URL", help="folder, or address such as s3://bucket/rigs")
    for name, help_ in _LIMITS.items():
        option = f"--{name.replace('_', '-')}"
        parser.add_argument(option, type=number(0), default=0.0, metavar="N", help=help_)
    parser.add_argument("--rig", help="only sessions of this rig")
    parser.add_argument(
        "--remove", action="store_true", help="remove them; without it they are only listed"
    )
    parser.add_argument(
        "--keep-seconds",
        action="store_true",
        help="keep the least, mean and largest value of each second, alarms and losses",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success, 1 if a session cannot be removed."""
    from rigwatch.archive import Store, retain

    found = retain(
        Store(arguments.url),
        _rules(arguments),
        rig=arguments.rig,
        remove=arguments.remove,
        keep_seconds=arguments.keep_seconds,
        say=say,
    )
    print_result(arguments, found, _lines(found, removed=arguments.remove))
    for failure in found.failures:
        say(f"failed: {failure}")
    return EXIT_FAILED if found.failures else 0


def _rules(arguments: argparse.Namespace) -> "RecorderSection":
    from rigwatch.wire.rig_config import RecorderSection
    from rigwatch.wire.typed_files import converted

    limits = {name: getattr(arguments, name) for name in _LIMITS}
    if not any(limits.values()):
        raise ArchiveError("retain: found no limit, expected --keep-days, --keep-gigabytes, …")
    return converted(limits, RecorderSection, "retain")


def _lines(found: "Retained", *, removed: bool) -> list[str]:
    size = sum(one.size for one in found.expired) / 1e9
    done = f"{found.removed} removed" if removed else "remove them with --remove"
    total = f"{len(found.expired)} of {found.sessions} sessions have expired, {size:.3g} GB; {done}"
    rows = [
        (one.rig, one.session, _day(one.ended), f"{one.size / 1e6:.1f} MB", _alarms(one.alarms))
        for one in found.expired
    ]
    shown = table(("rig", "session", "end", "size", "alarms"), rows) if rows else []
    unknown = len(found.unknown)
    new = [f"{unknown} new or changed sessions stay: rigwatch archive index"] if unknown else []
    undated = len(found.undated)
    timeless = [f"{undated} sessions stay that do not tell when they were recorded: import --start"]
    return [*shown, *new, *(timeless if undated else []), total]


def _day(ended: float) -> str:
    from datetime import UTC, datetime

    return datetime.fromtimestamp(ended, UTC).strftime("%Y-%m-%d")


def _alarms(alarms: bool) -> str:
    return "yes" if alarms else "no"
