"""Studies of `sim_plant.machines`: logs as CSV, imported, with the study that a user writes."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.workbench.study import Study, open_study
from sim_plant.machines import MACHINES, Machine, log, strength_for
from sim_plant.machines.loggers import logged

UNITS = {"N": "N", "m": "m", "m_s2": "m/s^2", "V": "V", "rad_s": "rad/s", "rad": "rad", "s": "s"}
"""Units by the endings of column names."""
STUDIES = {
    "oscillator": 'model = "mass-spring-damper"\nhorizon = 1.0\n',
    "motor": 'model = "motor"\nhorizon = 0.3\nstart = { R = 2.0, K = 0.06 }\n',
    "pendulum": 'model = "pendulum"\nhorizon = 1.0\nstart = { R = 4.0, K = 0.5 }\n',
    "damper": 'model = "damper"\n[derive]\nlow_pass = 20.0\n'
    'signals.velocity = { channel = "displacement", order = 1 }\n',
    "tanks": 'model = "tanks"\nhorizon = 150.0\nstart = { A1 = 0.0028, A2 = 0.0032 }\n',
    "cascade": 'model = "cascade"\nstart = { A1 = 0.0031, A2 = 0.0026 }\n',
}
"""Settings of each machine's study, without its recordings."""
WITH_HEALTHY = ("oscillator",)
"""Machines with a healthy recording."""


def machine_study(  # noqa: PLR0917 -- what makes a case
    folder: Path,
    machine: str,
    shares: Mapping[str, float],
    noise: float,
    seed: int,
    logger: str = "",
) -> Study:
    """The study of a machine with hidden effects.

    Args:
        folder: for its files.
        machine: its name.
        shares: share of the outputs' rms that each hidden effect changes alone.
        noise: of the sensors, relative to the rms of their signals.
        seed: of the recordings.
        logger: one of `LOGGERS`; empty for logs without a fault.
    """
    plant, text = MACHINES[machine], STUDIES[machine]
    hidden = {name: strength_for(plant, name, share, seed) for name, share in shares.items()}
    recordings = [("train", hidden, seed), ("held_out", hidden, seed + 1000)]
    if machine in WITH_HEALTHY:
        recordings.append(("healthy", {}, seed + 2000))
    for use, effects, own_seed in recordings:
        given = (plant, effects, noise, own_seed)
        _write(folder / f"{use}.csv", logged(*given, logger) if logger else log(*given))
        mapping = ImportMapping(
            channels=_channels(plant.columns), time="time_s[s]", held=_held(plant) if logger else ()
        )
        import_file(folder / f"{use}.csv", folder / f"{use}.mcap", mapping)
        text += f'\n[[{use}]]\nsession = "{use}.mcap"\n'
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return open_study(folder)


def _held(plant: Machine) -> tuple[str, ...]:
    """Channels of commands, which are held from sample to sample."""
    if not plant.any_clock:
        return ()
    return tuple(column.partition("_")[0] for column in plant.columns[: plant.commanded])


def _channels(columns: tuple[str, ...]) -> dict[str, str]:
    """Channels by the columns that they are read from, with their units."""
    parts = (column.partition("_") for column in columns)
    return {name: f"{name}_{end}[{UNITS[end]}]" for name, _, end in parts}


def _write(path: Path, table: Mapping[str, np.ndarray]) -> None:
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(table), comments="", fmt="%.9g")
