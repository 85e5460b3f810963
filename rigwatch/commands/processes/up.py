"""`rigwatch up`: starts and supervises the processes of one or several rigs."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from rigwatch.commands.common import POSITIVE, file_or_name
from rigwatch.supervisor import (
    PROCESSES,
    Console,
    Flow,
    OwnHeartbeat,
    RigSet,
    Supervisor,
    planned,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.host import endpoint_address, is_free
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.several_rigs import Rigs, valid_rigs

NO_DASHBOARD = "no dashboard for several rigs: `rigwatch fleet`, or `rigwatch dashboard` of one"
HELP = "start and supervise all processes of one or several rigs"
EXAMPLE = """  rigwatch up configs/demo.toml
  rigwatch up configs/demo.toml --without dashboard --json
  rigwatch up rigs/*.toml               # one daq, monitor and recorder for all of them"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    help_ = "configuration of a rig; several rigs share daq, monitor and recorder"
    parser.add_argument("config", type=file_or_name(""), nargs="+", metavar="CONFIG", help=help_)
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        choices=PROCESSES,
        metavar="PROCESS",
        help=f"omit one of {', '.join(PROCESSES)}; may be given more than once",
    )
    parser.add_argument(
        "--seconds",
        type=POSITIVE,
        default=float("inf"),
        metavar="N",
        help="stop after this time",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run until a signal or for the given time; 0 after an orderly stop."""
    remarks: list[str] = []
    rigs = _loaded(arguments.config, remarks.append)
    _refuse_second_start(rigs, arguments.without)
    console = Console(_name(rigs), arguments.json)
    for remark in remarks:
        console.remark(remark)
    paths, without = arguments.config, arguments.without
    supervisor = Supervisor(planned(paths, rigs, without), console.event)
    supervisor.stop_on_signals()
    if len(paths) > 1 and "dashboard" not in without and any(one.dashboard for _, one in rigs):
        console.remark(NO_DASHBOARD)
    flow, heartbeat = Flow(supervisor), OwnHeartbeat(supervisor)
    rig_set = RigSet(paths, rigs, without, supervisor, console.changed)
    stop_at = time.monotonic() + arguments.seconds

    def each_turn() -> None:
        flow.update()
        rig_set.check()
        console.status(supervisor, flow)
        heartbeat.turn(flow.totals.get("daq", 0))
        if time.monotonic() >= stop_at:
            supervisor.stop()

    supervisor.run(each_turn)
    heartbeat.stopping()
    console.close()
    return 0


def _loaded(paths: list[Path], say: Callable[[str], None]) -> Rigs:
    """The configurations; of several, those that are valid."""
    if len(paths) == 1:
        return [(paths[0], load_rig(paths[0]))]
    return valid_rigs(paths, lambda mistake: say(f"{mistake}; this rig is left out"))


def _name(rigs: Rigs) -> str:
    return rigs[0][1].rig.id if len(rigs) == 1 else f"{len(rigs)} rigs"


def _refuse_second_start(rigs: Rigs, without: list[str]) -> None:
    """Refuse a second `up` on one bus: the rig would have two sources of samples."""
    for listen in {config.bus.listen for _, config in rigs}:
        address = endpoint_address(listen)
        if "router" not in without and address is not None and not is_free(*address):
            raise BusError(
                f"bus.listen: {listen} is in use: is this rig up already? "
                "Stop it, or name another port in [bus]"
            )
