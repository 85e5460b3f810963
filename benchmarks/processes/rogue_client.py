"""Hostile clients against a real router, monitor, witness and source, with and without keys.

Four clients send 200 kinds of message to every topic and every queryable, over and over with new
draws. With keys they have certificates of other roles, and beside them strangers without one
connect. Without keys they are programs of the same machine that do not have the rig's secret; none
of them calls itself `monitor`, `daq` or `witness`, from which only keys protect (docs/security.md).
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.access.attack import Outcome, attacked
from tests.access.rogue import everything, kinds
from tools.benchmark_table import Row


def run(quick: bool) -> list[Row]:
    """Twenty seconds each, or ten minutes."""
    seconds = 20.0 if quick else 600.0
    with TemporaryDirectory() as first, TemporaryDirectory() as second:
        return [
            row_with_keys(measured(Path(first), seconds, keys=True)),
            row_without_keys(measured(Path(second), seconds, keys=False)),
        ]


def measured(folder: Path, seconds: float, *, keys: bool) -> Outcome:
    """The outcome of an attack of this length [s]."""
    with attacked(folder, keys=keys) as rig:
        until, seed = time.monotonic() + seconds, 1
        while time.monotonic() < until:
            rig.attack(everything(kinds(seed)), until)
            if keys:
                rig.knock(20)
            seed += 1
        return rig.judge()


def row_with_keys(found: Outcome) -> Row:
    """The row of a rig whose router denies."""
    uncounted = max(0.0, found.sent["denied"] - found.denied)
    uncounted += max(0.0, found.sent["command"] - found.refused)
    uncounted += max(0.0, found.connections - found.refused_connections)
    note = (
        f"{sum(found.sent.values())} messages and queries from 4 clients with certificates: "
        f"{found.sent['denied']} not allowed, {found.denied:.0f} counted by the router; "
        f"{found.sent['command']} forged commands, {found.refused:.0f} counted; "
        f"{found.connections} connections without one, {found.refused_connections:.0f} counted; "
        f"{found.samples} samples compared"
    )
    return _row("hostile clients", found, uncounted, note)


def row_without_keys(found: Outcome) -> Row:
    """The row of a rig whose processes have to drop what is not their owners'."""
    uncounted = max(0.0, found.sent["command"] - found.refused)
    uncounted += max(0.0, found.sent["samples"] - found.dropped)
    uncounted += max(0.0, found.sent["numbered"] - found.foreign)
    note = (
        f"{sum(found.sent.values())} messages and queries from 4 clients of the same machine: "
        f"{found.sent['command']} forged commands, {found.refused:.0f} counted; "
        f"{found.sent['samples']} forged samples and payloads, {found.dropped:.0f} counted; "
        f"{found.sent['numbered']} forged alarms, estimates and model changes, "
        f"{found.foreign:.0f} counted; "
        f"{found.samples} samples compared"
    )
    return _row("hostile clients of a rig without keys", found, uncounted, note)


def _row(who: str, found: Outcome, uncounted: float, note: str) -> Row:
    counts = (len(found.ended), found.wrong + found.lost, len(found.changes), round(uncounted))
    return Row(
        f"{who}: processes ended, wrong or lost samples, changes, attempts not counted",
        ", ".join(map(str, counts)),
        "0, 0, 0, 0",
        "",
        note,
        passed=not any(counts),
    )
