"""Drawn rigs that differ in their equations, played through the commands.

    python -m benchmarks.family.rig_family FOLDER --members calibration --part watch
    python -m benchmarks.family.rig_family FOLDER --members iso spool --write-only

Members go to FOLDER/NAME in the layout of a foreign rig, results of the commands to
FOLDER/NAME/work. Thresholds and calibrations may be chosen on the calibration members only; the
two groups are printed separately.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.family.rig_folder import RigFolder, Tally
from benchmarks.family.rig_folder_explain import explained
from benchmarks.family.rig_folder_watch import watched
from sim_plant.family import FLAVOURS, draw, write_rig

GROUPS = ("calibration", "judged")
PARTS = ("watch", "explain")


def main() -> int:
    """Writes missing members and, unless disabled, prints the results; returns 0."""
    arguments = _parser().parse_args()
    parts = tuple(arguments.part or PARTS)
    totals: dict[str, Tally] = {}
    for flavour in _flavours(arguments.members):
        folder = arguments.folder / f"{flavour}_{arguments.seed}"
        if not (folder / "truth.json").exists():
            print(f"{folder}: writing", file=sys.stderr, flush=True)
            write_rig(folder, draw(flavour, arguments.seed))
        if not arguments.write_only:
            rig = RigFolder(folder, folder / "work")
            group = FLAVOURS[flavour].group
            for title, tally in _scores(rig, parts, arguments):
                totals.setdefault(f"{group}, {title}", Tally()).add(tally)
    for title, tally in totals.items():
        print(f"all of {title}: {tally}")
    return 0


def _scores(
    rig: RigFolder, parts: tuple[str, ...], chosen: argparse.Namespace
) -> list[tuple[str, Tally]]:
    """Plays the parts, prints them recording by recording, returns the counts of right results."""
    scores = []
    if "watch" in parts:
        watch = watched(rig, weighed=chosen.weighed)
        print(*watch.lines, f"{rig.recordings.name} watch: {watch.summary()}", sep="\n", flush=True)
        watch.tally.count("other faults not called friction", right=not watch.miscalled)
        scores.append(("watch", watch.tally))
    if "explain" in parts:
        for model in chosen.models:
            found = explained(rig, model, weighed=chosen.weighed)
            title = f"{rig.recordings.name} explain {model}"
            print(*found.lines, f"{title}: {found.summary()}", sep="\n", flush=True)
            found.tally.count("members without a wrong one", right=not found.wrong)
            scores.append((f"explain {model}", found.tally))
    return scores


def _flavours(chosen: list[str]) -> list[str]:
    """Flavours of the groups and flavours named; all if none is named."""
    chosen = chosen or list(GROUPS)
    return [name for name, kind in FLAVOURS.items() if name in chosen or kind.group in chosen]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.family.rig_family", description=__doc__
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("folder", type=Path, help="members are written to it")
    parser.add_argument(
        "--members", nargs="+", default=[], choices=(*GROUPS, *FLAVOURS), help="default: all"
    )
    parser.add_argument("--part", nargs="+", choices=PARTS, help="default: both")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn, default 1")
    parser.add_argument(
        "--models", nargs="+", default=["servo-pneumatic", "fourth-order"], help="bases of explain"
    )
    parser.add_argument("--weighed", action="store_true", help="state the mass, within 1 %%")
    parser.add_argument("--write-only", action="store_true", help="write, do not play")
    return parser


if __name__ == "__main__":
    sys.exit(main())
