"""`rigwatch study promote`: the model goes to the running monitor, else into its file."""

import argparse
import getpass
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import print_json, say

if TYPE_CHECKING:
    from rigwatch.wire.bus import Granted, Wish

HELP = "hand the accepted model to the monitor of a rig, or take the one before again"
EXAMPLE = """\
  rigwatch study promote emps --rig emps-rig.toml
  rigwatch study promote emps --rig emps-rig.toml --rollback"""
LINK_TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--rig", type=Path, required=True, metavar="CONFIG", help="the rig's configuration"
    )
    parser.add_argument("--rollback", action="store_true", help="the model before again")
    parser.add_argument("--user", default="", help="who acts; else the user logged in")


def run(arguments: argparse.Namespace) -> int:
    """0 where the other model is in force; 1 where the monitor refuses it."""
    from monitor.model import load_model
    from monitor.process import monitor_section
    from rigwatch.wire.bus import Wish
    from rigwatch.wire.rig_config import load_rig
    from rigwatch.workbench.steps import promotion
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    path = Path(monitor_section(load_rig(arguments.rig), arguments.rig).model)
    user, name = arguments.user or getpass.getuser(), study.folder.resolve().name
    found = None
    if arguments.rollback:
        wish = Wish("rollback", "", user, f"rolled back from study {name}")
    else:
        found = promotion(study, load_model(path))
        effects = ", ".join(a.effect for a in study.file.effects)
        wish = Wish("promote", found.text, user, f"study {name}: {effects}")
    granted, live = _send(arguments.rig, path, wish)
    if granted.done:
        from rigwatch.workbench.study import ledger

        ledger.append(study, wish.action, rig=str(arguments.rig), live=live, text=granted.text)
    if arguments.json:
        residual = {"before": found.before, "after": found.after} if found else None
        learnt = found.learnt if found else None
        print_json({"granted": granted, "live": live, "residual": residual, "learnt": learnt})
    else:
        if found:
            fall = f"{found.before:.4g} → {found.after:.4g} m/s^2"
            print(f"the monitor's residual on the recordings held out: {fall}")
        print(f"{path}: {granted.text}")
    return 0 if granted.done else 1


def _send(rig: Path, path: Path, wish: "Wish") -> "tuple[Granted, bool]":
    """The monitor's answer; where none runs, the file is changed for its next start."""
    from rigwatch.wire.bus import ask_for_model, connect, unique_process
    from rigwatch.wire.errors import BusError
    from rigwatch.wire.rig_config import load_rig

    try:
        bus = connect(load_rig(rig), unique_process("promote"), LINK_TIMEOUT)
        try:
            return ask_for_model(bus, wish), True
        finally:
            bus.close()
    except BusError as error:
        say(f"{error}; the file is changed for its next start")
        return _in_file(path, wish), False


def _in_file(path: Path, wish: "Wish") -> "Granted":
    from monitor.model import model_versions as versions
    from rigwatch.wire.bus import Granted

    now = time.time_ns()
    if wish.action == "rollback":
        versions.roll_back(path, now, wish.user, wish.text)
    else:
        versions.install(path, wish.model, now, wish.user, wish.text)
    return Granted(True, "in force from the monitor's next start on")
