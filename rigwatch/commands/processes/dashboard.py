"""`rigwatch dashboard`: shows a rig live."""

import argparse
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import PORT, say
from rigwatch.wire.errors import ConfigError, RigwatchError

if TYPE_CHECKING:
    from rigwatch.dashboard.board import Facts

HELP = "show a rig live: signals, residual, friction estimates, alarms and what to do"
EXAMPLE = """  rigwatch dashboard configs/demo.toml
  rigwatch dashboard configs/demo.toml --viewer web"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, help="configuration of the rig (TOML)")
    parser.add_argument(
        "--viewer",
        choices=("auto", "native", "web", "connect", "headless"),
        help="kind of viewer; default: dashboard.viewer of the configuration",
    )
    help_ = "port of the page of the viewer `web`, whose data then take a free one; default: "
    parser.add_argument(
        "--port", type=PORT, metavar="PORT", help=help_ + "dashboard.web_port and grpc_port"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if stopped or the window is closed."""
    from rigwatch.dashboard import require_rerun
    from rigwatch.wire.rig_config import DashboardSection, load_rig

    config = load_rig(arguments.config)
    if arguments.port is not None and not 0 < arguments.port <= 65535:
        raise RigwatchError(f"--port: found {arguments.port}, expected 1 to 65535")
    require_rerun()
    # Plain messages replace Rerun's own lines about a lost viewer.
    os.environ.setdefault("RUST_LOG", "off")
    from msgspec.structs import replace

    from rigwatch.dashboard.process import LiveDashboard
    from rigwatch.wire.bus import joined
    from rigwatch.wire.host import free_port, set_at_signal

    settings = config.dashboard or DashboardSection()
    if arguments.port is not None:
        settings = replace(settings, web_port=arguments.port, grpc_port=free_port())
    choice, stop = arguments.viewer or settings.viewer, set_at_signal()
    with joined(config, "dashboard", stop) as bus:
        if bus is None:
            return 0
        live = LiveDashboard(bus, settings, choice, _say_json if arguments.json else say, stop)
        if config.monitor is not None:
            _know_model(live.facts, config.monitor.model)
        live.run()
    return 0


def _know_model(facts: "Facts", path: str) -> None:
    """Read signature and limits from the model; a screen without them is better than none."""
    from rigwatch.commands.common import marks_of

    facts.model = Path(path).name
    try:
        facts.marks = marks_of(path)
    except ConfigError as error:
        say(f"signature and limits are not shown: {error}")


def _say_json(text: str) -> None:
    print(json.dumps({"remark": text}), flush=True)
