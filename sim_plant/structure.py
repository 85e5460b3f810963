"""Simulates a structure with sensors: the records for tests of identification.

Only the file is shared with `rigwatch structure`: the equations here are assembled element by
element and integrated by extrapolation, with steps finer than the record's.
"""

import copy
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import loads
from sim_plant.structure_kernel import GROUND, Elements, Floats, Loads, integrate

_LAWS = ("linear", "hardening", "softening", "gap")
_PARTS = {"stiffness": 0, "damping": 0, "quadratic": 1, "cubic": 2, "length": 3}
FINEST_TURN = 0.2
"""Radians of the fastest motion per integration step."""


@dataclass(frozen=True)
class Damage:
    """A change of some numbers of the structure at `time`.

    Attributes:
        time: [s].
        values: new values by their place in the file, such as {"springs.k4_46.stiffness": 50.0}.
    """

    time: float
    values: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class StructureRecord:
    """The sensor signals of a structure.

    Attributes:
        time: shape (n,) [s].
        columns: each of shape (n,): positions x6 [m], velocities v6 [m/s], accelerations a6
            [m/s^2] of every node, and the recorded loads by their channels.
    """

    time: Floats
    columns: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class _Numbers:
    """A structure as the arrays that the kernel takes."""

    mass: Floats
    springs: Elements
    dampers: Elements


def simulate(
    file: Path | str,
    dt: float,
    duration: float,
    *,
    loads: Mapping[str, Mapping[str, Any]] | None = None,
    recorded: Mapping[str, Floats] | None = None,
    values: Mapping[str, float] | None = None,
    damages: Iterable[Damage] = (),
) -> StructureRecord:
    """Records of every node's motion from t = 0 on.

    Args:
        file: the structure file; its values hold in truth.
        dt: time between samples [s].
        duration: [s]; the sample at its end is included.
        loads: instead of the file's, in the file's words.
        recorded: loads by channel, sampled every dt, a line between samples.
        values: values that replace the file's, by their place there: {"springs.k1_6.cubic": 500.0}.
        damages: changes during the record.

    Raises:
        ConfigError: the file cannot be read, or is incomplete for a simulation.
    """
    raw = _read(Path(file))
    time = sample_times(dt, duration)
    try:
        _replace(raw, values or {})
        chosen = raw.get("loads", {}) if loads is None else loads
        pushes = _loads(chosen, list(raw["nodes"]), recorded or {}, dt)
        path = _path(raw, time, pushes, sorted(damages, key=lambda damage: damage.time))
    except (KeyError, ValueError, TypeError) as error:
        found = f"{type(error).__name__} at {error}"
        raise ConfigError(file, "", found, "nodes, springs and loads that fit") from error
    columns = {
        f"{kind}{node}" if node[:1].isdigit() else f"{kind}_{node}": path[:, order, index]
        for order, kind in enumerate("xva")
        for index, node in enumerate(raw["nodes"])
    }
    return StructureRecord(time, columns | dict(recorded or {}))


def sample_times(dt: float, duration: float) -> Floats:
    """Times from 0 to `duration`, both included, shape (n,) [s]."""
    return np.arange(round(duration / dt) + 1, dtype=np.float64) * np.float64(dt)


def with_noise(
    record: StructureRecord, shares: Mapping[str, float], seed: int, *, normal: bool = False
) -> StructureRecord:
    """Noise on the named columns, as a share of each one's peak.

    Args:
        record: the noise-free record.
        shares: by column, half width of the uniform noise, or standard deviation of the normal one,
            over the column's peak.
        seed: of the random numbers.
        normal: normal instead of uniform noise.
    """
    random = np.random.default_rng(seed)
    columns = dict(record.columns)
    for name, share in shares.items():
        size, count = share * float(np.max(np.abs(columns[name]))), len(record.time)
        noise = random.standard_normal(count) if normal else random.uniform(-1.0, 1.0, count)
        columns[name] = columns[name] + size * noise
    return StructureRecord(record.time, columns)


def _read(path: Path) -> dict[str, Any]:
    try:
        return loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(path, "", str(error), "a readable structure file") from error


def _replace(raw: dict[str, Any], values: Mapping[str, float]) -> None:
    for place, value in values.items():
        table, entry, part = place.split(".")
        raw[table][entry][part] = value


def _value(number: Any) -> float:
    return float(number["value"] if isinstance(number, Mapping) else number)


def _numbers(raw: Mapping[str, Any]) -> _Numbers:
    number = {node: index for index, node in enumerate(raw["nodes"])}
    return _Numbers(
        np.array([_value(node["mass"]) for node in raw["nodes"].values()]),
        _elements(raw.get("springs", {}), number),
        _elements(raw.get("dampers", {}), number),
    )


def _elements(table: Mapping[str, Mapping[str, Any]], number: Mapping[str, int]) -> Elements:
    entries = list(table.values())
    numbers = np.zeros((len(entries), 4))
    for row, entry in zip(numbers, entries, strict=True):
        for part in _PARTS.keys() & entry.keys():
            row[_PARTS[part]] = _value(entry[part])
    first = [number[entry["between"][0]] for entry in entries]
    second = [number[e["between"][1]] if len(e["between"]) > 1 else GROUND for e in entries]
    law = [_LAWS.index(entry.get("law", "linear")) for entry in entries]
    return Elements(
        np.array(first, np.int64), np.array(second, np.int64), np.array(law, np.int64), numbers
    )


def _loads(
    loads: Mapping[str, Mapping[str, Any]],
    nodes: list[str],
    recorded: Mapping[str, Floats],
    dt: float,
) -> Loads:
    pushed = [(GROUND if load.get("base") else nodes.index(load["node"]), load)
              for load in loads.values()]  # fmt: skip
    steps = [(n, (ld["step"], ld.get("start", 0.0))) for n, ld in pushed if "step" in ld]
    sines = [
        (node, (sine["amplitude"], sine["omega"], sine.get("phase", 0.0)))
        for node, load in pushed
        for sine in load.get("sines", ())
    ]
    records = [(node, recorded[load["channel"]]) for node, load in pushed if load.get("channel")]
    columns = [np.asarray(column, np.float64) for _, column in records]
    return Loads(
        np.array([node for node, _ in steps], np.int64),
        np.array([row for _, row in steps], np.float64).reshape(-1, 2),
        np.array([node for node, _ in sines], np.int64),
        np.array([row for _, row in sines], np.float64).reshape(-1, 3),
        np.array([node for node, _ in records], np.int64),
        np.stack(columns, axis=1) if columns else np.zeros((2, 0)),
        dt,
    )


def _path(raw: Mapping[str, Any], time: Floats, loads: Loads, damages: list[Damage]) -> Floats:
    """Positions, velocities and accelerations at `time`, shape (n, 3, nodes)."""
    subject = copy.deepcopy(dict(raw))
    nodes = subject["nodes"].values()
    x, v = (np.array([_value(node.get(key, 0.0)) for node in nodes]) for key in "xv")
    breaks = [d.time for d in damages]
    path = np.empty((len(time), 3, len(x)))
    for index, start in enumerate([-np.inf, *breaks]):
        if index:
            _replace(subject, damages[index - 1].values)
        end = breaks[index] if index < len(breaks) else np.inf
        rows = np.flatnonzero((time >= start) & (time < end))
        events = [
            t for t in (start, end, *loads.step[:, 1]) if max(start, 0.0) <= t <= min(end, time[-1])
        ]
        grid = np.unique(np.concatenate([time[rows], events]))
        if len(grid):
            found = _integrated(_numbers(subject), grid, x, v, loads)
            path[rows] = found[np.searchsorted(grid, time[rows])]
    return path


def _integrated(numbers: _Numbers, grid: Floats, x: Floats, v: Floats, loads: Loads) -> Floats:
    """Moves x and v along the grid, in steps that the fastest motion asks for."""
    found = np.empty((len(grid), 3, len(x)))
    longest = float(np.max(np.diff(grid), initial=0.0))
    parts = max(1, math.ceil(longest * _fastest(numbers, loads) / FINEST_TURN))
    integrate(grid, parts, x, v, numbers.mass, numbers.springs, numbers.dampers, loads, found)
    return found


def _fastest(numbers: _Numbers, loads: Loads) -> float:
    """A bound of the angular frequencies of masses and loads [rad/s]."""
    held = np.zeros(len(numbers.mass))
    for ends in (numbers.springs.first, numbers.springs.second):
        inside = ends != GROUND
        np.add.at(held, ends[inside], numbers.springs.numbers[inside, 0])
    # Gershgorin: no eigenvalue of M⁻¹·K exceeds twice the stiffness at a mass over that mass.
    return float(max(np.sqrt(np.max(2.0 * held / numbers.mass)), loads.sine[:, 1].max(initial=0.0)))
