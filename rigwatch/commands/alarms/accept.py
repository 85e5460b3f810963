"""`rigwatch accept`: a person's word for a device that daq refuses, or a wiring that fails."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import add_user, print_json
from rigwatch.wire.wiring_names import WIRING

if TYPE_CHECKING:
    from rigwatch.wire.bus import Bus, DeviceReply, ModelReply
    from rigwatch.wire.rig_config import RigConfig

HELP = "accept another device in the place of the first one, or a wiring that does not pass"
EXAMPLE = """  rigwatch accept rig.toml --user ann --text "converter exchanged"
  rigwatch accept rig.toml wiring_sign --user ann --text "the sensor hangs upside down"
  rigwatch accept rig.toml --show"""
TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    parser.add_argument(
        "wiring",
        nargs="?",
        choices=WIRING,
        metavar="WIRING",
        help="the alarm of a wiring that is as it is to be: " + ", ".join(WIRING),
    )
    add_user(parser)
    parser.add_argument("--text", default="", help="reason, kept with the device or the model")
    parser.add_argument(
        "--show", action="store_true", help="only say which device is the rig's, and which answers"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the device or the wiring is accepted, or shown; 1 if nothing changes."""
    from rigwatch.wire.bus import connect, unique_process
    from rigwatch.wire.errors import RigwatchError
    from rigwatch.wire.rig_config import load_rig

    if arguments.wiring and arguments.show:
        raise RigwatchError(
            f"--show: found {arguments.wiring}, expected no alarm: `rigwatch alarms`"
        )
    config = load_rig(arguments.config)
    if not arguments.wiring:
        _check_unnamed(config, arguments.config)
    bus = connect(config, unique_process("accept"), TIMEOUT)
    try:
        asked = _wiring if arguments.wiring else _device
        reply = asked(bus, config, arguments)
    finally:
        bus.close()
    well = reply.done or arguments.show
    if arguments.json:
        print_json(reply)
    else:
        print(reply.text, file=sys.stdout if well else sys.stderr)
    return 0 if well else 1


def _check_unnamed(config: "RigConfig", path: Path) -> None:
    from rigwatch.wire.errors import ConfigError

    if named := getattr(config.daq.device, "identity", ""):
        raise ConfigError(
            path, "daq.device.identity", repr(named),
            "that of the device: what the configuration names is not accepted otherwise",
        )  # fmt: skip


def _device(bus: "Bus", config: "RigConfig", arguments: argparse.Namespace) -> "DeviceReply":
    from rigwatch.wire.access import operator_name
    from rigwatch.wire.bus import DeviceRequest, accept_device, ask_for_device

    reply = ask_for_device(bus)
    if arguments.show or not reply.refused:
        return reply
    user = operator_name(config.bus, arguments.user)
    return accept_device(bus, DeviceRequest(reply.answers, user, arguments.text))


def _wiring(bus: "Bus", config: "RigConfig", arguments: argparse.Namespace) -> "ModelReply":
    from rigwatch.wire.access import operator_name
    from rigwatch.wire.bus import ModelRequest, ask_for_model

    user = operator_name(config.bus, arguments.user)
    return ask_for_model(bus, ModelRequest("accept", arguments.wiring, user, arguments.text))
