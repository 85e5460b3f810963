"""The data sets: recordings of input and output, and the model that a user starts from."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from rigwatch.wire.arrays import FloatArray
from sim_plant.oscillator import DAMPING, MASS, RATE, STIFFNESS, Hidden, oscillate, strength_for
from tests.workbench.simulated import multisine, size_of

Term = Callable[..., object]
"""A force over mass as a function of position, velocity and the module whose tanh is used."""


@dataclass(frozen=True, eq=False)
class Part:
    """One recording: input and output, each of shape (n,)."""

    u: FloatArray
    y: FloatArray


@dataclass(frozen=True, eq=False)
class Task:
    """One data set for a second-order model d²y/dt² = g·u - c·v - k·y + terms.

    Attributes:
        name: heading of its rows.
        unit: of the output.
        shown: unit to show errors in, and its size.
        dt: time between samples [s].
        train, held_out: recordings.
        start: initial g, c and k; k is not fitted if it is 0.
        terms: the physics that is missing, known from publications or from the simulation, with
            initial values. Given only to the users who are said to know it.
        effects: names of the missing physics in rigwatch's library.
        words: the same in words.
        thin: decimation for discrete-time models, which need few samples per period.
        coarse: decimation for all others, where the recording is much faster than the machine.
        floor: error below which only noise is left.
    """

    name: str
    unit: str
    shown: tuple[str, float]
    dt: float
    train: tuple[Part, ...]
    held_out: tuple[Part, ...]
    start: tuple[float, float, float]
    terms: tuple[tuple[float, Term], ...]
    effects: tuple[str, ...]
    words: str
    thin: int
    coarse: int
    floor: str


def tasks() -> list[Task]:
    """The simulated oscillator and, if their files are there, the measured data sets."""
    root = Path(os.environ.get("RIGWATCH_DATA", "."))
    found = [_simulated()]
    if (root / "emps" / "DATA_EMPS.mat").is_file():
        found.append(_emps(root / "emps"))
    if (root / "silverbox" / "SNLS80mV.mat").is_file():
        found.append(_silverbox(root / "silverbox" / "SNLS80mV.mat"))
    return found


def rms_error(task: Task, predicted: Sequence[FloatArray]) -> float:
    """Error of free runs over all held-out recordings; infinite if one diverged.

    Args:
        task: the data.
        predicted: by recording, at every sample or at every n-th.
    """
    squares = [
        (run - part.y[:: round(len(part.y) / len(run))][: len(run)]) ** 2
        for run, part in zip(predicted, task.held_out, strict=True)
    ]
    found = float(np.sqrt(np.mean(np.concatenate(squares))))
    return found if np.isfinite(found) else float("inf")


def every(part: Part, count: int) -> Part:
    """A recording at every n-th sample."""
    return Part(part.u[::count], part.y[::count])


def coarse(task: Task) -> Task:
    """The recordings at the rate that a slow machine needs."""
    n = task.coarse
    train, held_out = (tuple(every(p, n) for p in parts) for parts in (task.train, task.held_out))
    return replace(task, dt=task.dt * n, train=train, held_out=held_out, coarse=1)


def _simulated() -> Task:
    """The oscillator of the hidden effects, with dry friction that changes its output by 5 %."""
    lines = np.arange(0.2, 6.0, 0.2)
    forces = [multisine(lines, 3.0, seed=seed) for seed in (4, 5)]
    hidden = Hidden("coulomb", strength_for("coulomb", forces[0], 0.05))
    noise = 2e-3 * size_of(forces[0])
    parts = [
        Part(force, oscillate(force, (hidden,), noise, seed)[:, 0])
        for seed, force in zip((4, 5), forces, strict=True)
    ]
    return Task(
        "simulated oscillator", "m", ("mm", 1e3), 1 / RATE, (parts[0],), (parts[1],),
        (1 / MASS * 0.8, DAMPING / MASS * 1.5, STIFFNESS / MASS * 0.9),
        ((0.1, lambda _x, v, m: -m.tanh(v / 1e-3)),),
        ("coulomb",), "dry friction", 4, 1, f"{2 * size_of(parts[1].u)[0]:.2g} mm noise",
    )  # fmt: skip


def _emps(folder: Path) -> Task:
    def part(name: str) -> Part:
        data = loadmat(folder / name)
        return Part(data["vir"][:, 0] * float(data["gtau"][0, 0]), data["qm"][:, 0])

    return Task(
        "EMPS", "m", ("mm", 1e3), 1e-3,
        (part("DATA_EMPS.mat"),), (part("DATA_EMPS_PULSES.mat"),),
        (1 / 95.0, 200.0 / 95.0, 0.0),
        (
            (0.1, lambda _x, v, m: -m.tanh(v / 1e-4)),
            (-0.01, lambda x, _v, _m: 1.0 + 0.0 * x),
        ),
        ("coulomb", "constant_force"), "dry friction and an offset",
        20, 10, "3.98 mm, published grey box",
    )  # fmt: skip


def _silverbox(path: Path) -> Task:
    data, rate = loadmat(path), 610.3515625
    u, y = data["V1"][0].astype(np.float64), data["V2"][0].astype(np.float64)

    def part(begin: float, end: float) -> Part:
        rows = slice(round(begin * rate), round(end * rate))
        return Part(u[rows], y[rows])

    return Task(
        "Silverbox", "V", ("mV", 1e3), 1 / rate, (part(66.602, 86.602),),
        (part(173.205, 191.205), part(0.164, 66.478)), (1.8e5, 50.0, 1.8e5),
        ((7e5, lambda x, _v, _m: -(x**3)),),
        ("cubic_stiffness",), "a cubic spring", 1, 1, "noise below 1 mV",
    )  # fmt: skip
