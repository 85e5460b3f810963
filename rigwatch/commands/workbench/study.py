"""`rigwatch study`: makes a study, shows its ledger, takes changed data."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json, say

HELP = "make a study of a model and recordings, show what was done in it"
EXAMPLE = """\
  rigwatch study new emps --template configs/studies/emps.toml --sessions recordings/
  rigwatch study show emps
  rigwatch study report emps --output emps.html
  rigwatch study view emps --save emps.rrd
  rigwatch study promote emps --rig emps-rig.toml
  rigwatch study replay emps"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "action",
        choices=["new", "show", "report", "view", "promote", "replay", "accept-data"],
        help="new: make it; show: its ledger; report: write an HTML page;"
        " view: measured and modelled signals of every step;"
        " promote: hand the model to the rig's monitor;"
        " replay: fit every step again and compare;"
        " accept-data: go on with recordings that have changed",
    )
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument("--template", type=Path, metavar="TOML", help="study file to start from")
    parser.add_argument(
        "--sessions", type=Path, metavar="FOLDER", help="where the template's sessions are"
    )
    parser.add_argument("--output", type=Path, metavar="HTML", help="the report's file")
    parser.add_argument("--save", type=Path, metavar="FILE", help="view: write a file for Rerun")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="view: write a picture")
    parser.add_argument(
        "--rig", type=Path, metavar="CONFIG", help="promote: the rig's configuration"
    )
    parser.add_argument("--rollback", action="store_true", help="promote: the model before again")
    parser.add_argument("--user", default="", help="promote: who acts; else the user logged in")


def run(arguments: argparse.Namespace) -> int:
    """0 on success; 1 where a replay gives other errors than the ledger."""
    from rigwatch.commands.workbench.study_promote import promote
    from rigwatch.commands.workbench.study_report import report
    from rigwatch.commands.workbench.study_view import view

    actions = {
        "new": _new,
        "show": _show,
        "report": report,
        "view": view,
        "promote": promote,
        "replay": _replay,
        "accept-data": _accept,
    }
    return actions[arguments.action](arguments)


def _new(arguments: argparse.Namespace) -> int:
    from rigwatch.wire.errors import ConfigError
    from rigwatch.workbench.study import create, ledger

    if arguments.template is None:
        raise ConfigError(arguments.study, "--template", "nothing", "a study file to start from")
    study = create(arguments.study, arguments.template, arguments.sessions)
    line = ledger.append(study, "new")
    if arguments.json:
        print_json(line)
        return 0
    print(f"{study.folder}: model {study.model.name}: {study.model.summary}")
    print(f"  {len(study.effects)} effects may be tried; next: rigwatch explain {study.folder}")
    return 0


def _show(arguments: argparse.Namespace) -> int:
    from rigwatch.workbench.report import number, table
    from rigwatch.workbench.study import ledger, open_study

    study = open_study(arguments.study)
    steps = list(ledger.lines(study))
    if arguments.json:
        print_json({"model": study.model.name, "effects": study.file.effects, "ledger": steps})
        return 0
    print(f"{study.folder}: model {study.model.name}: {study.model.summary}")
    for accepted in study.file.effects:
        print(f"  + {accepted.effect}@{accepted.port}: {study.effects[accepted.effect].physics}")
    rows = [
        [
            line["time"],
            line["step"],
            f"{line['effect']}@{line['port']}" if "effect" in line else "",
            number(line.get("train_error")),
            number(line.get("held_out_error")),
            line.get("unit", ""),
        ]
        for line in steps
    ]
    print("\n".join(table(["time", "step", "effect", "training", "held out", "unit"], rows)))
    return 0


def _replay(arguments: argparse.Namespace) -> int:
    from rigwatch.workbench.steps import replay
    from rigwatch.workbench.study import open_study

    checks = replay(open_study(arguments.study), progress=say)
    if arguments.json:
        print_json(checks)
    else:
        for check in checks:
            print(f"{'same' if check.same else 'DIFFERS'}: {check.text}")
    return 0 if all(check.same for check in checks) else 1


def _accept(arguments: argparse.Namespace) -> int:
    from rigwatch.workbench.study import ledger, open_study

    line = ledger.append(open_study(arguments.study), "accept-data")
    if arguments.json:
        print_json(line)
    else:
        print(f"{arguments.study}: goes on with the recordings as they are now")
    return 0
