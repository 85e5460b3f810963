"""`rigwatch structure damage`: finds whether, when, where and how much a structure is damaged."""

import argparse
import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import (
    POSITIVE,
    add_many,
    file_or_name,
    print_result,
    run_many,
    say,
    the_one,
)
from rigwatch.commands.structures.structure_files import (
    RECORD,
    add_report,
    add_test,
    write_page,
)
from rigwatch.commands.structures.structure_view import add_views, damage_lines, draw_damage, wanted
from rigwatch.wire.errors import ModelError

if TYPE_CHECKING:
    from rigwatch.structures.damage import Damage, Examination, Figure, Settings

HELP = "find damage in a record: its instant, its place among all springs, and its size"
EXAMPLE = """\
  rigwatch structure simulate configs/structures/kabe_antenna.toml damaged.csv \\
      --damage 5 springs.k4_46.stiffness=50
  rigwatch structure damage configs/structures/kabe_antenna.toml damaged.csv --report damage.html
  rigwatch structure damage configs/structures/kabe_antenna.toml damaged.csv --save damage.rrd
  rigwatch structure damage antenna.toml sessions/antenna.mcap --undamaged 4 --false-alarms 0.001
  rigwatch structure damage antenna.toml sessions --on local:4 --results damages.parquet"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument(
        "structure",
        type=file_or_name("structures"),
        help="structure file of the undamaged structure",
    )
    add_many(parser, "record", RECORD)
    parser.add_argument(
        "--undamaged",
        type=POSITIVE,
        metavar="SECONDS",
        help="length of the undamaged start",
    )
    parser.add_argument(
        "--limit", type=POSITIVE, help="fixed limit of the residual instead of a test"
    )
    add_test(
        parser,
        "in a whole record",
        "data for the first identification, and shortest time between damages, default 2",
    )
    add_report(parser)
    add_views(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the record is examined, damaged or not; 1 if some of several cannot be."""
    record = the_one(arguments, arguments.record)
    return _run_many(arguments) if record is None else _run_one(arguments, record)


def _run_many(arguments: argparse.Namespace) -> int:
    from rigwatch.batch import Job

    if arguments.report or wanted(arguments):
        raise ModelError("--report, --save, --picture: found several records, expected one")
    settings = {"structure": arguments.structure, **dataclasses.asdict(_settings(arguments))}
    job = Job("structure damage", examined)
    return run_many(arguments, arguments.record, job, settings, line=_line)


def examined(record: Path, structure: Path, **settings: Any) -> dict[str, Any]:
    """The result of one of several records: as for one."""
    from rigwatch.structures.damage import Settings, examine
    from rigwatch.structures.model import load_structure
    from rigwatch.structures.records import read_any

    found = examine(load_structure(structure), read_any(record), Settings(**settings))
    return {"damaged": bool(found.damages), "damage_count": len(found.damages)} | _whole(found)


def _line(found: dict[str, Any]) -> str:
    damages = (f"at {one['instant']:.3f} s: {_changed(one)}" for one in found["damages"])
    return "; ".join(damages) or "no damage"


def _changed(damage: dict[str, Any]) -> str:
    return ", ".join(damage["changed"]) or "no known coefficient"


def _settings(arguments: argparse.Namespace) -> "Settings":
    from rigwatch.structures.damage import Settings

    return Settings(
        undamaged=arguments.undamaged,
        rate=arguments.false_alarms,
        limit=arguments.limit,
        settle=arguments.settle,
        known=arguments.known,
        moving=arguments.moving,
    )


def _run_one(arguments: argparse.Namespace, record: Path) -> int:
    from rigwatch.structures.damage import examine
    from rigwatch.structures.model import load_structure
    from rigwatch.structures.records import read_any
    from rigwatch.structures.report import page, remark

    arguments.record = record
    drawn = wanted(arguments)
    found = examine(
        load_structure(arguments.structure), read_any(record), _settings(arguments), say
    )
    if sensors := remark(found).strip():
        say(sensors)
    if arguments.report:
        write_page(arguments.report, page(found, record.name))
    if drawn:
        draw_damage(arguments, found)
    lines = [line for damage in found.damages for line in damage_lines(damage)]
    print_result(arguments, _whole(found), lines or "no damage")
    return 0


def _whole(found: "Examination") -> dict[str, Any]:
    base = found.reference
    outputs = base.model.problem.system.model.outputs
    return {
        "undamaged": {
            "seconds": base.samples * base.model.dt,
            "parameters": _intervals(base.figures),
            "noise": dict(zip(base.model.signals, base.sigma.tolist(), strict=True)),
            "noise_units": {name: outputs[name].unit for name in base.model.signals},
            "unjudged": list(base.unjudged),
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
