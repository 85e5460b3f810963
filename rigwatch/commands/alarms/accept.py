"""`rigwatch accept`: takes the device that daq refuses for that of the rig."""

import argparse
import sys
from pathlib import Path

from rigwatch.commands.common import add_user, print_json

HELP = "accept another device in the place of the one that daq met first"
EXAMPLE = """  rigwatch accept rig.toml --user ann --text "converter exchanged"
  rigwatch accept rig.toml --show"""
TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    add_user(parser)
    parser.add_argument("--text", default="", help="reason, kept with the device")
    parser.add_argument(
        "--show", action="store_true", help="only say which device is the rig's, and which answers"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the device is accepted, or shown; 1 if nothing changes."""
    from rigwatch.wire.access import operator_name
    from rigwatch.wire.bus import (
        DeviceRequest,
        accept_device,
        ask_for_device,
        connect,
        unique_process,
    )
    from rigwatch.wire.errors import ConfigError
    from rigwatch.wire.rig_config import load_rig

    config = load_rig(arguments.config)
    if named := getattr(config.daq.device, "identity", ""):
        raise ConfigError(
            arguments.config, "daq.device.identity", repr(named),
            "that of the device: what the configuration names is not accepted otherwise",
        )  # fmt: skip
    bus = connect(config, unique_process("accept"), TIMEOUT)
    try:
        reply = ask_for_device(bus)
        if reply.refused and not arguments.show:
            user = operator_name(config.bus, arguments.user)
            reply = accept_device(bus, DeviceRequest(reply.answers, user, arguments.text))
    finally:
        bus.close()
    well = reply.done or arguments.show
    if arguments.json:
        print_json(reply)
    else:
        print(reply.text, file=sys.stdout if well else sys.stderr)
    return 0 if well else 1
