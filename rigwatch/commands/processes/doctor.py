"""`rigwatch doctor`: checks the installation, this machine and a configuration."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.supervisor import PROCESSES
from rigwatch.wire.errors import ConfigError, RigwatchError
from rigwatch.wire.rig_config import load_rig

if TYPE_CHECKING:
    from rigwatch.doctor import Finding

HELP = "check the installation, ports, devices and a configuration"
EXAMPLE = """  rigwatch doctor
  rigwatch doctor configs/demo.toml
  rigwatch doctor configs/demo.toml --alive daq
  rigwatch doctor configs/demo.toml --fix     # after an update, with the rig stopped"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "config", type=Path, nargs="?", metavar="CONFIG", help="configuration to check as well"
    )
    parser.add_argument(
        "--fix",
        action="store_true",
        help="repair configuration, model, journal, positions and sessions of earlier versions or "
        "after a kill; the previous file stays beside each",
    )
    parser.add_argument(
        "--alive",
        choices=PROCESSES,
        metavar="PROCESS",
        help=f"only check the health of this running process: {', '.join(PROCESSES)}",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print every finding; 1 if one of them prevents rigwatch from running."""
    findings = []
    for finding in _selected(arguments):
        findings.append(finding)
        if not arguments.json:
            print(_line(finding), flush=True)
    if arguments.json:
        print(json.dumps([asdict(finding) for finding in findings], indent=1))
    return 1 if any(finding.level == "fail" for finding in findings) else 0


def _selected(arguments: argparse.Namespace) -> "Iterator[Finding]":
    if arguments.alive is None:
        if arguments.fix and arguments.config is None:
            raise ConfigError("rigwatch doctor", "--fix", "no CONFIG", "the rig's configuration")
        yield from _findings(arguments.config, fix=arguments.fix)
        return
    if arguments.config is None:
        raise ConfigError("rigwatch doctor", "--alive", "no CONFIG", "the rig's configuration")
    from rigwatch.doctor import check_alive

    yield check_alive(load_rig(arguments.config), arguments.alive)


def _findings(config: Path | None, *, fix: bool) -> "Iterator[Finding]":
    from rigwatch.doctor import check_machine, check_rig, check_viewer

    yield from check_machine(_recordings(config))
    yield from check_viewer()
    if config is not None:
        yield from check_rig(config, fix=fix)


def _recordings(config: Path | None) -> Path:
    """The folder for recordings; a wrong configuration is reported by its own check."""
    try:
        recorder = load_rig(config).recorder if config is not None else None
    except RigwatchError:
        recorder = None
    return Path(recorder.folder if recorder is not None else "sessions")


def _line(finding: "Finding") -> str:
    remedy = f" -> {finding.remedy}" if finding.remedy else ""
    return f"{finding.level:4} {finding.what:24} {finding.text}{remedy}"
