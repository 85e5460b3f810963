"""`rigwatch structure damage`: finds whether, when, where and how much a structure is damaged."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import file_or_name, print_json, say
from rigwatch.commands.structures.structure_files import (
    add_record,
    add_report,
    add_test,
    write_page,
)
from rigwatch.commands.structures.structure_view import add_views, damage_lines, draw_damage, wanted

if TYPE_CHECKING:
    from rigwatch.structures.damage import Damage, Examination, Figure

HELP = "find damage in a record: its instant, its place among all springs, and its size"
EXAMPLE = """\
  rigwatch structure simulate configs/structures/kabe_antenna.toml damaged.csv \\
      --damage 5 springs.k4_46.stiffness=50
  rigwatch structure damage configs/structures/kabe_antenna.toml damaged.csv --report damage.html
  rigwatch structure damage configs/structures/kabe_antenna.toml damaged.csv --save damage.rrd
  rigwatch structure damage antenna.toml sessions/antenna.mcap --undamaged 4 --false-alarms 0.001"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument(
        "structure",
        type=file_or_name("structures"),
        help="structure file of the undamaged structure",
    )
    add_record(parser)
    parser.add_argument(
        "--undamaged", type=float, metavar="SECONDS", help="length of the undamaged start"
    )
    parser.add_argument("--limit", type=float, help="fixed limit of the residual instead of a test")
    add_test(
        parser,
        "in a whole record",
        "data for the first identification, and shortest time between damages, default 2",
    )
    add_report(parser)
    add_views(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the record is examined, damaged or not."""
    from rigwatch.structures.damage import Settings, examine
    from rigwatch.structures.model import load_structure
    from rigwatch.structures.records import read_any
    from rigwatch.structures.report import page, remark

    settings = Settings(
        undamaged=arguments.undamaged,
        rate=arguments.false_alarms,
        limit=arguments.limit,
        settle=arguments.settle,
        known=arguments.known,
    )
    drawn = wanted(arguments)
    found = examine(load_structure(arguments.structure), read_any(arguments.record), settings, say)
    if sensors := remark(found).strip():
        say(sensors)
    if arguments.report:
        write_page(arguments.report, page(found, arguments.record.name))
    if drawn:
        draw_damage(arguments, found)
    if arguments.json:
        print_json(_whole(found))
    elif not found.damages:
        print("no damage")
    else:
        for damage in found.damages:
            print("\n".join(damage_lines(damage)))
    return 0


def _whole(found: "Examination") -> dict[str, Any]:
    base = found.reference
    return {
        "undamaged": {
            "seconds": base.samples * base.model.dt,
            "parameters": _intervals(base.figures),
            "noise": dict(zip(base.model.signals, base.sigma.tolist(), strict=True)),
        },
        "threshold": found.watches[0].threshold,
        "damages": [_plain(damage) for damage in found.damages],
    }


def _intervals(figures: "Mapping[str, Figure]") -> dict[str, Any]:
    return {
        name: {"value": figure.value, "interval": [figure.low, figure.high]}
        for name, figure in figures.items()
    }


def _plain(damage: "Damage") -> dict[str, Any]:
    return {
        "alarm": damage.alarm,
        "instant": damage.instant.time,
        "interval": [damage.instant.low, damage.instant.high],
        "explained": damage.explained,
        "changed": [place.name for place in damage.ranking.changed],
        "ranking": [
            {
                "coefficient": place.name,
                "spring": place.spring,
                "kind": place.kind,
                "p_value": place.p_value,
                "before": place.before,
                "after": place.after,
                "class": list(place.alike),
            }
            for place in damage.ranking.candidates
        ],
        "before": _intervals(damage.before),
        "parameters": _intervals(damage.figures),
        "unseen": list(damage.ranking.unseen),
    }
