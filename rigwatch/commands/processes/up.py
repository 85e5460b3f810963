"""`rigwatch up`: starts and supervises the processes of a rig."""

import argparse
import time

from rigwatch.commands.common import file_or_name
from rigwatch.supervisor import PROCESSES, ConfigWatch, Console, Flow, Supervisor, plan
from rigwatch.wire.errors import BusError
from rigwatch.wire.host import Heartbeat, endpoint_address, is_free
from rigwatch.wire.rig_config import RigConfig, load_rig

HELP = "start and supervise all processes of a rig"
EXAMPLE = """  rigwatch up configs/demo.toml
  rigwatch up configs/demo.toml --without dashboard --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "config", type=file_or_name(""), metavar="CONFIG", help="configuration of the rig"
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        choices=PROCESSES,
        metavar="PROCESS",
        help=f"omit one of {', '.join(PROCESSES)}; may be given more than once",
    )
    parser.add_argument(
        "--seconds", type=float, default=float("inf"), metavar="N", help="stop after this time"
    )


def run(arguments: argparse.Namespace) -> int:
    """Run until a signal or for the given time; 0 after an orderly stop."""
    config = load_rig(arguments.config)
    _refuse_second_start(config, arguments.without)
    console = Console(config.rig.id, arguments.json)
    plans = plan(config, arguments.config, arguments.without)
    supervisor = Supervisor(plans, console.event)
    supervisor.stop_on_signals()
    flow, heartbeat = Flow(supervisor), Heartbeat("up")
    watch = ConfigWatch(arguments.config, config, supervisor, console.changed)
    stop_at = time.monotonic() + arguments.seconds
    is_ready = False

    def each_turn() -> None:
        nonlocal is_ready
        flow.look()
        watch.look()
        console.status(supervisor, flow)
        if not is_ready and all(w.was_ready for w in supervisor.processes.values()):
            is_ready = True
            heartbeat.ready("all processes run")
        # The parent of this supervisor gets the same notification: samples advance.
        heartbeat.advance(flow.totals.get("daq", 0))
        if time.monotonic() >= stop_at:
            supervisor.stop()

    supervisor.run(each_turn)
    heartbeat.stopping()
    return 0


def _refuse_second_start(config: RigConfig, without: list[str]) -> None:
    """Refuse a second `up` on one bus: the rig would have two sources of samples."""
    address = endpoint_address(config.bus.listen)
    if "router" not in without and address is not None and not is_free(*address):
        raise BusError(
            f"bus.listen: {config.bus.listen} is in use: is this rig up already? "
            "Stop it, or name another port in [bus]"
        )
