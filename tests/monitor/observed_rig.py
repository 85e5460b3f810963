"""The observer scheme on the project's own simulated rig: recordings and a model, made once."""

import numpy as np

from monitor.commissioning.equations import commission_equations
from monitor.model.model_file import RigModel
from monitor.pipeline.rig_monitor import RigMonitor, Watched
from monitor.signals.recordings import Recording, Role, recording_of
from rigwatch.wire.messages.message_types import Alarm, Column, SampleBlock
from sim_plant.excitation import Chirp, Shape, Sine
from sim_plant.scenario import Event, Scenario, ScenarioRun
from tests.made_once import made_once

RATE = 256.0
UNITS = {"voltage": "V", "position": "m", "acceleration": "m/s^2"}
FAULTS = {"departure", "dry_friction", "stiction", "other_fault"}
SINE = Sine(amplitude=1.4, frequency=8.0)
FREE = Sine(amplitude=1.4, frequency=8.0 * 1.0037)
SLOWER = Sine(amplitude=1.0, frequency=6.0)


def run(
    drive: Shape, seconds: float, events: tuple[Event, ...] = (), seed: int = 1
) -> dict[str, np.ndarray]:
    """Calibrated channels of a run that begins at rest."""
    case = Scenario(name="test", duration_s=seconds, excitation=drive, events=events)
    raw = ScenarioRun(case, seed).advance(round(seconds * RATE))
    values = raw.codes * case.plant.si_per_code
    return {name: values[:, k].copy() for k, name in enumerate(UNITS)}


def coulomb(at_s: float, level: float = 0.6) -> tuple[Event, ...]:
    """Dry friction from `at_s` on [N]."""
    return (Event(at_s=at_s, effect="coulomb", value=level),)


def healthy_recordings() -> list[Recording]:
    """A chirp and two sines; no recording of a fault."""
    sweep = Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=14.0)
    made: list[tuple[Role, str, Shape, float]] = [
        ("chirp", "chirp", sweep, 14.0),
        ("healthy", "sine", SINE, 10.0),
        ("healthy", "slower", SLOWER, 10.0),
    ]
    return [
        recording_of(role, name, RATE, run(drive, seconds, seed=20 + k))
        for k, (role, name, drive, seconds) in enumerate(made)
    ]


@made_once
def model() -> RigModel:
    """Commissioned from healthy recordings alone."""
    return commission_equations(healthy_recordings())


def block(channels: dict[str, np.ndarray], first: int = 0, last: int | None = None) -> SampleBlock:
    """Samples `first` to before `last` as one block."""
    end = len(channels["voltage"]) if last is None else last
    at = np.arange(first, end, dtype=np.int64)
    columns = tuple(Column(name, UNITS[name], channels[name][first:end].copy()) for name in UNITS)
    return SampleBlock("rig", 1, first, at * 3906, at * 3_906_250, columns)


def watched(channels: dict[str, np.ndarray], known: RigModel | None = None) -> Watched:
    """What the monitor makes of a whole recording."""
    found = RigMonitor(known or model()).update(block(channels))
    assert found is not None
    return found


def raised(found: Watched) -> dict[str, float]:
    """Time of the first transition of each alarm [s]."""
    times: dict[str, float] = {}
    for said in found.announcements:
        if isinstance(said, Alarm):
            times.setdefault(said.name, said.seq / RATE)
    return times
