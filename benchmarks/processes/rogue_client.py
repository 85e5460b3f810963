"""A hostile client against a rig with keys: real router, monitor, witness and source, mutual TLS.

Four clients with certificates of other roles send 200 kinds of message to every topic and every
queryable, over and over with new draws; beside them strangers without a certificate connect.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.access.attack import Outcome, attacked
from tests.access.rogue import everything, kinds
from tools.benchmark_table import Row


def run(quick: bool) -> list[Row]:
    """Twenty seconds, or ten minutes."""
    with TemporaryDirectory() as folder:
        return [row(measured(Path(folder), 20.0 if quick else 600.0))]


def measured(folder: Path, seconds: float) -> Outcome:
    """The outcome of an attack of this length [s]."""
    with attacked(folder) as rig:
        until, seed = time.monotonic() + seconds, 1
        while time.monotonic() < until:
            rig.attack(everything(kinds(seed)), until)
            rig.knock(20)
            seed += 1
        return rig.judge()


def row(found: Outcome) -> Row:
    """The table's row."""
    kept = not found.ended and not found.wrong and not found.lost and not found.changes
    uncounted = found.sent["denied"] - found.denied
    unseen = found.connections - found.refused_connections
    note = (
        f"{sum(found.sent.values())} messages and queries from 4 clients with certificates: "
        f"{found.sent['denied']} not allowed, {found.denied:.0f} counted by the router; "
        f"{found.sent['command']} forged commands, {found.refused:.0f} counted by the monitor; "
        f"{found.connections} connections without one, {found.refused_connections:.0f} counted; "
        f"{found.samples} samples compared"
    )
    return Row(
        "hostile clients: processes ended, wrong or lost samples, changes, attempts not counted",
        f"{len(found.ended)}, {found.wrong + found.lost}, {len(found.changes)}, "
        f"{max(0.0, uncounted) + max(0.0, unseen):.0f}",
        "0, 0, 0, 0",
        "",
        note,
        passed=kept and uncounted <= 0 and unseen <= 0,
    )
