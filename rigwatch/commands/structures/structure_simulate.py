"""`rigwatch structure simulate`: simulates a record of a structure."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import POSITIVE, file_or_name, number, say, whole
from rigwatch.wire.errors import ModelError

if TYPE_CHECKING:
    from sim_plant.structure import Damage

HELP = "simulate a record, to try the other commands on"
EXAMPLE = """\
  rigwatch structure simulate configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure simulate kabe.toml damaged.csv --damage 5 springs.k4_46.stiffness=50
  rigwatch structure simulate configs/structures/shear_frame.toml frame.csv --noise 0.05"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("structure", type=file_or_name("structures"), help="structure file (.toml)")
    parser.add_argument("record", type=Path, help="the new record (.csv or .npz)")
    parser.add_argument("--dt", type=POSITIVE, default=0.01, help="time between samples [s]")
    parser.add_argument("--duration", type=POSITIVE, default=10.0, help="length [s]")
    parser.add_argument(
        "--noise",
        type=number(0),
        default=0.0,
        help="standard deviation as a share of each signal's peak",
    )
    parser.add_argument("--seed", type=whole(0), default=0, help="seed of noise and earthquake")
    parser.add_argument(
        "--damage", nargs=2, action="append", metavar=("SECONDS", "PLACE=VALUE"),
        help="change a coefficient from that time on",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """0 if the record is written."""
    from rigwatch.structures.model import load_structure
    from rigwatch.structures.records import record_of, write_record
    from sim_plant.earthquake import accelerogram
    from sim_plant.structure import simulate, with_noise

    if not (arguments.dt > 0 and arguments.duration >= 2 * arguments.dt):
        raise ModelError("--dt, --duration: expected a step above 0 and at least three samples")
    structure = load_structure(arguments.structure)
    recorded = {
        load.channel: accelerogram(arguments.dt, arguments.duration, arguments.seed)
        for load in structure.loads.values()
        if load.channel
    }
    made = simulate(
        arguments.structure, arguments.dt, arguments.duration, recorded=recorded,
        damages=[_damage(*pair) for pair in arguments.damage or ()],
    )  # fmt: skip
    if arguments.noise:
        made = with_noise(made, dict.fromkeys(structure.signals, arguments.noise), arguments.seed)
    kept = {name: made.columns[name] for name in (*structure.signals, *recorded)}
    write_record(record_of(made.time, kept), arguments.record)
    say(f"{arguments.record}: {len(made.time)} samples of {', '.join(kept)}")
    return 0


def _damage(seconds: str, change: str) -> "Damage":
    from sim_plant.structure import Damage

    place, _, value = change.partition("=")
    try:
        return Damage(float(seconds), {place: float(value)})
    except ValueError:
        found = f"{seconds} {change}"
        raise ModelError(f"--damage: found {found!r}, expected 5 springs.k1.stiffness=50") from None
