"""`rigwatch structure watch`: monitors a structure for damage, online or over a session."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import POSITIVE, file_or_name, print_json
from rigwatch.commands.structures.structure_files import add_test

if TYPE_CHECKING:
    from rigwatch.structures.live import LiveDamage

HELP = "monitor a structure: samples in; residuals, alarm and place of damage out"
EXAMPLE = """\
  rigwatch structure watch configs/structures/kabe_antenna.toml rig.toml
  rigwatch structure watch configs/structures/kabe_antenna.toml sessions/antenna.mcap"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument(
        "structure",
        type=file_or_name("structures"),
        help="structure file of the undamaged structure",
    )
    parser.add_argument(
        "source", type=Path, help="configuration of the rig (.toml) whose bus to read, or a session"
    )
    parser.add_argument(
        "--undamaged", type=POSITIVE, default=2.0, metavar="SECONDS",
        help="length of the undamaged start, default 2",
    )  # fmt: skip
    parser.add_argument(
        "--span",
        type=POSITIVE,
        default=60.0,
        metavar="SECONDS",
        help="period of the false-alarm probability, default 60",
    )
    add_test(
        parser, "within --span", "length of data after an alarm used to find the place, default 2"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 after a signal, or at the end of the session."""
    if arguments.source.suffix == ".toml":
        return _on_line(arguments)
    return _over_session(arguments)


def _on_line(arguments: argparse.Namespace) -> int:
    from rigwatch.structures.live import watch_rig
    from rigwatch.wire.rig_config import load_rig

    config = load_rig(arguments.source)
    watch_rig(config, _watched(arguments, config.rig.sample_rate))
    return 0


def _over_session(arguments: argparse.Namespace) -> int:
    from rigwatch.wire.messages import Alarm, EstimateBlock
    from rigwatch.wire.session import open_session

    session = open_session(arguments.source)
    watched = _watched(arguments, session.info.sample_rate_hz)
    said = [
        message
        for block in session.samples()
        for message in watched.update(block)
        if not isinstance(message, EstimateBlock)
    ]
    if arguments.json:
        print_json(said)
        return 0
    for message in said:
        words = message.cause if isinstance(message, Alarm) else message.text
        name = message.name if isinstance(message, Alarm) else message.code
        print(f"{message.severity}  {name}: {words}")
    return 0


def _watched(arguments: argparse.Namespace, rate: float) -> "LiveDamage":
    """The requested monitor at a sample rate [Hz]."""
    from rigwatch.structures.live import LiveDamage, LiveSettings
    from rigwatch.structures.model import load_structure

    settings = LiveSettings(
        arguments.undamaged,
        arguments.false_alarms,
        arguments.span,
        arguments.settle,
        arguments.known,
        arguments.moving,
    )
    return LiveDamage(load_structure(arguments.structure), 1.0 / rate, settings)
