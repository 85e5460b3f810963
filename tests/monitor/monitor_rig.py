"""A commissioned model of the simulated rig and recordings of it, made once for this folder."""

import numpy as np

from monitor.commissioning.commission import commission
from monitor.model.model_file import RigModel
from monitor.pipeline.pipeline import Monitor, Result
from monitor.signals.recordings import recording_of
from rigwatch.wire.messages.message_types import Column, SampleBlock
from sim_plant.excitation import Chirp, Shape, Sine
from sim_plant.scenario import Event, Scenario, ScenarioRun
from tests.made_once import made_once

RATE = 256.0
UNITS = {"voltage": "V", "position": "m", "acceleration": "m/s^2"}
SINE = Sine(amplitude=1.4, frequency=8.0)
OTHER_SINE = Sine(amplitude=1.2, frequency=8.0)


def run(
    drive: Shape, seconds: float, events: tuple[Event, ...] = (), seed: int = 1
) -> dict[str, np.ndarray]:
    """Calibrated channels of a run that has been going for 10 s before t = 0."""
    case = Scenario(
        name="test", duration_s=seconds, lead_in_s=10.0, excitation=drive, events=events
    )
    raw = ScenarioRun(case, seed).advance(round(seconds * RATE))
    values = raw.codes * case.plant.si_per_code
    return {name: values[:, k].copy() for k, name in enumerate(UNITS)}


def friction(at_s: float, level: float = 0.4, **others: float) -> tuple[Event, ...]:
    """Dry friction, and other effects by name, from `at_s` on."""
    names = {"coulomb": level, **others}
    return tuple(Event(at_s=at_s, effect=name, value=value) for name, value in names.items())


def fault(effect: str, value: float, at_s: float = 4.0) -> tuple[Event, ...]:
    """One effect from `at_s` on."""
    return (Event(at_s=at_s, effect=effect, value=value),)


@made_once
def model() -> RigModel:
    """Commissioned from a chirp, a healthy reference and a known friction."""
    sweep = Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=16.0)
    return commission(
        [
            recording_of("chirp", "chirp", RATE, run(sweep, 64.0, seed=11)),
            recording_of("healthy", "healthy", RATE, run(SINE, 30.0, seed=12)),
            recording_of("friction", "friction", RATE, run(SINE, 16.0, friction(10.0), seed=13)),
        ]
    )


def block(
    channels: dict[str, np.ndarray], first: int = 0, last: int | None = None, boot: int = 1
) -> SampleBlock:
    """Samples `first` to before `last` as one block."""
    end = len(channels["voltage"]) if last is None else last
    at = np.arange(first, end, dtype=np.int64)
    return SampleBlock(
        "rig",
        boot,
        first,
        at * 3906,
        at * 3_906_250,
        tuple(Column(name, UNITS[name], channels[name][first:end].copy()) for name in UNITS),
    )


def watched(channels: dict[str, np.ndarray]) -> Result:
    """The monitor's result over a whole recording."""
    result = Monitor(model()).update(block(channels))
    assert result is not None
    return result


def active(result: Result, name: str) -> np.ndarray:
    """The flags of one condition."""
    return next(c.active for c in result.conditions if c.name == name)
