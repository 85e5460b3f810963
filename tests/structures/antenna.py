"""The Kabe antenna and records of it, for the tests."""

from pathlib import Path

import msgspec

from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Load
from rigwatch.structures.records.record import Record
from sim_plant.structure import simulate

FOLDER = Path(__file__).parents[2] / "configs" / "structures"
FILE = FOLDER / "kabe_antenna.toml"
NAMES = ["k4_46", "k1_6", "k1_6_cubic"]
TRUTH = dict(zip(NAMES, (100.0, 1000.0, 100.0), strict=True))


def antenna(**load):
    structure = load_structure(FILE)
    if not load:
        return structure
    return msgspec.structs.replace(structure, loads={"push": msgspec.convert(load, Load)})


def positions(made, h, nodes=range(1, 9)):
    return Record(h, {f"x{node}": made.columns[f"x{node}"] for node in nodes})


def record(h=0.01, duration=10.0, nodes=range(1, 9), **options):
    return positions(simulate(FILE, h, duration, **options), h, nodes)
