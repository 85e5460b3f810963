"""What the benchmarks of the monitor share: scenarios of the simulated rig, a commissioned model,
first samples of conditions.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from monitor.commissioning.commission import commission
from monitor.model.model_file import RigModel
from monitor.pipeline.pipeline import Monitor
from monitor.pipeline.result import Result
from monitor.signals.conditions import SENSOR_CLIPPED
from monitor.signals.recordings import Recording, Role, recording_of
from rigwatch.wire.messages.message_types import Column, SampleBlock
from sim_plant.scenario import Scenario, ScenarioRun, load_scenario

SCENARIOS = Path(__file__).parents[2] / "configs" / "scenarios"
RATE = 256.0
PERSISTENCE = 2
"""Samples a condition has to hold before it counts, as the alarms have it by default."""
_UNITS = {"voltage": "V", "position": "m", "acceleration": "m/s^2"}
_COMMISSIONING_SEED = 40_000


def scenario(name: str) -> Scenario:
    """A scenario of configs/scenarios by its file name without ending."""
    return load_scenario(SCENARIOS / f"{name}.toml")


def blocks(case: Scenario, seed: int, size: int = 16384) -> Iterator[SampleBlock]:
    """The scenario's samples, calibrated, in blocks."""
    run = ScenarioRun(case, seed)
    left = run.samples or 0
    seq = 0
    while left > 0:
        raw = run.advance(min(size, left))
        values = raw.codes * case.plant.si_per_code
        at = np.arange(seq, seq + len(raw), dtype=np.int64)
        columns = tuple(
            Column(name, unit, np.ascontiguousarray(values[:, place]))
            for place, (name, unit) in enumerate(_UNITS.items())
        )
        yield SampleBlock("rig", 1, seq, raw.device_us, at * round(1e9 / RATE), columns)
        seq, left = seq + len(raw), left - len(raw)


def record(name: str, role: Role, seed: int) -> Recording:
    """A commissioning recording made from a scenario of configs/scenarios."""
    return record_of(scenario(name), role, seed)


def record_of(case: Scenario, role: Role, seed: int) -> Recording:
    """A commissioning recording of a whole scenario."""
    parts = list(blocks(case, seed))
    channels = {
        key: np.concatenate([block.channel(key).values for block in parts]) for key in _UNITS
    }
    return recording_of(role, case.name, RATE, channels)


@cache
def commissioned(references: bool = False) -> RigModel:
    """The model of the simulated rig: one chirp, one known friction, one healthy reference or
    (slower) all there are.
    """
    healthy = ["healthy_sine_8hz_1v4"]
    if references:
        healthy = sorted(path.stem for path in SCENARIOS.glob("healthy_*.toml"))
    names: list[tuple[str, Role]] = [("commissioning_chirp", "chirp")]
    names += [(name, "healthy") for name in healthy] + [("known_friction", "friction")]
    return commission(
        [record(name, role, _COMMISSIONING_SEED + k) for k, (name, role) in enumerate(names)]
    )


def watched(case: Scenario, seed: int, model: RigModel | None = None) -> list[Result]:
    """The monitor's results over a whole scenario."""
    monitor = Monitor(model or commissioned())
    results = [monitor.update(block) for block in blocks(case, seed)]
    return [result for result in results if result is not None]


def active(results: list[Result], name: str) -> NDArray[np.uint8]:
    """The flag of one condition over all results."""
    return np.concatenate(
        [c.active for result in results for c in result.conditions if c.name == name]
    )


def column(results: list[Result], name: str) -> NDArray[np.float64]:
    """One estimate over all results."""
    return np.concatenate([result.estimates.column(name).values for result in results])


def clipped(results: list[Result], after_s: float, before_s: float = np.inf) -> bool:
    """Whether any channel is said to be clipped between two times [s]."""
    names = {c.name for result in results[:1] for c in result.conditions}
    found = [active(results, name) for name in names if name.startswith(SENSOR_CLIPPED)]
    first = int(np.ceil(after_s * RATE))
    last = None if np.isinf(before_s) else int(before_s * RATE)
    return any(bool(flags[first:last].any()) for flags in found)


def delay(results: list[Result], name: str, after_s: float) -> float | None:
    """Time from `after_s` to the sample that completes the persistence of a condition [s], None
    where it never does.
    """
    first = int(np.ceil(after_s * RATE))
    flags = active(results, name).astype(np.int64)[first:]
    held = np.convolve(flags, np.ones(PERSISTENCE, np.int64))[: flags.size] >= PERSISTENCE
    found = np.flatnonzero(held)
    return (first + int(found[0])) / RATE - after_s if found.size else None
