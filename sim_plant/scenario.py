"""A scenario: plant, excitation, effects and events, as a TOML file, and its run.

name, description, duration_s, lead_in_s
[plant]       parameters that differ from `RigParameters`
[excitation]  shape = "sine" and its keys
[effects]     effects present from the start
[[events]]    at_s, effect, value, over_s: an effect set, or ramped over a time
[experiment]  published figures of the experiment that it reproduces
"""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta, field, structs

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section, find_file, load
from sim_plant.effects import complaint
from sim_plant.excitation import Excitation, drive
from sim_plant.parameters import RigParameters
from sim_plant.rig import RawSamples, Rig


class Event(Section, frozen=True, kw_only=True):
    """[[events]] — one effect changes."""

    at_s: Annotated[float, Meta(ge=0, description="when [s]")]
    effect: Annotated[str, Meta(description="name of the effect")]
    value: Annotated[float, Meta(description="its new value, in the effect's unit")]
    over_s: Annotated[float, Meta(ge=0, description="length of a ramp, 0 for a step [s]")] = 0.0


class Experiment(Section, frozen=True, kw_only=True):
    """[experiment] — published figures of the experiment (Tables 5.2 and 5.3)."""

    test: Annotated[int, Meta(ge=1, description="number of the experiment")]
    fault_s: Annotated[tuple[float, ...], Meta(description="when friction begins [s]")]
    ramp_end_s: Annotated[float | None, Meta(description="when a gradual one ends [s]")] = None
    detection_s: Annotated[float | None, Meta(description="published detection time [s]")] = None
    character: Annotated[str, Meta(description="published character of the fault")] = ""


class Scenario(Section, frozen=True, kw_only=True):
    """One scenario file."""

    name: Annotated[str, Meta(min_length=1, description="short name")]
    description: Annotated[str, Meta(description="description and purpose")] = ""
    duration_s: Annotated[float, Meta(gt=0, description="length from t = 0, may be inf [s]")]
    lead_in_s: Annotated[float, Meta(ge=0, description="run time before t = 0 [s]")] = 0.0
    cycle_s: Annotated[
        float, Meta(ge=0, description="period of the events, 0 for no repetition [s]")
    ] = 0.0
    plant: Annotated[RigParameters, Meta(description="parameters of the rig")] = field(
        default_factory=RigParameters
    )
    excitation: Annotated[Excitation, Meta(description="excitation")]
    effects: Annotated[dict[str, float], Meta(description="effects from the start")] = field(
        default_factory=dict
    )
    events: Annotated[tuple[Event, ...], Meta(description="what happens")] = ()
    experiment: Annotated[Experiment | None, Meta(description="published figures")] = None

    def healthy(self, duration_s: float | None = None) -> "Scenario":
        """The same rig and drive without effects and events, `duration_s` long if given."""
        return structs.replace(
            self,
            name=f"{self.name}-healthy",
            duration_s=duration_s or self.duration_s,
            effects={},
            events=(),
            cycle_s=0.0,
            experiment=None,
        )


def load_scenario(path: Path | str) -> Scenario:
    """The scenario at `path`, or the shipped one of that name.

    A recorded drive's file is relative to it.

    Raises:
        ConfigError: the file does not fit, names an unknown effect, or its events do not fit in.
    """
    path = find_file(path, "scenarios")
    scenario = load(path, Scenario)
    for index, event in enumerate(scenario.events):
        _check_effect(path, f"events[{index}]", event.effect, event.value)
        if scenario.cycle_s and event.at_s + event.over_s > scenario.cycle_s:
            expected = f"an end before cycle_s = {scenario.cycle_s} s"
            raise ConfigError(path, f"events[{index}].at_s", f"{event.at_s} s", expected)
    for name, value in scenario.effects.items():
        _check_effect(path, f"effects.{name}", name, value)
    return _with_paths(scenario, Path(path).parent)


def _check_effect(path: Path | str, key: str, name: str, value: float) -> None:
    if wrong := complaint(name, value):
        raise ConfigError(path, key, *wrong)


def _with_paths(scenario: Scenario, folder: Path) -> Scenario:
    file = getattr(scenario.excitation, "file", "")
    if not file:
        return scenario
    return structs.replace(
        scenario, excitation=structs.replace(scenario.excitation, file=str(folder / file))
    )


class ScenarioRun:
    """A running scenario.

    Args:
        scenario: the scenario.
        seed: of the sensors' noise.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario
        self.rig = Rig(scenario.plant, seed)
        self._rate = scenario.plant.sample_rate
        self._next = -round(scenario.lead_in_s * self._rate)
        self._drive = drive(scenario.excitation, self._rate, begins=self._next)
        self._events = sorted(scenario.events, key=lambda event: event.at_s)
        self._done = 0
        for name, value in scenario.effects.items():
            self.rig.set_effect(name, value)
        self._run_up()

    @property
    def duration_s(self) -> float:
        """Length of the scenario from t = 0 [s], infinite if it is endless."""
        return self.scenario.duration_s

    @property
    def samples(self) -> int | None:
        """Number of samples in the scenario, None if it is endless."""
        return None if math.isinf(self.duration_s) else round(self.duration_s * self._rate)

    def advance(self, n: int) -> RawSamples:
        """The next `n` samples; a run may continue beyond its duration."""
        parts = []
        end = self._next + n
        while self._next < end:
            self._start_events()
            parts.append(self._run_to(min(end, self._next_event())))
        return _joined(parts) if parts else self.rig.advance(np.empty(0))

    def _run_up(self) -> None:
        while self._next < 0:
            self._run_to(min(0, self._next + 4096))
        self.rig.restart_count()

    def _run_to(self, end: int) -> RawSamples:
        numbers = np.arange(self._next, end, dtype=np.int64)
        self._next = end
        return self.rig.advance(self._drive(numbers))

    def _event_sample(self, number: int) -> int:
        """Sample at which the event `number` starts, counted over all cycles."""
        cycle, index = divmod(number, len(self._events))
        return round((cycle * self.scenario.cycle_s + self._events[index].at_s) * self._rate)

    def _next_event(self) -> int:
        return self._event_sample(self._done) if self._remaining() else np.iinfo(np.int64).max

    def _remaining(self) -> bool:
        return bool(self._events) and (self.scenario.cycle_s > 0 or self._done < len(self._events))

    def _start_events(self) -> None:
        while self._remaining() and self._event_sample(self._done) <= self._next:
            event = self._events[self._done % len(self._events)]
            self.rig.set_effect(event.effect, event.value, event.over_s)
            self._done += 1


def _joined(parts: list[RawSamples]) -> RawSamples:
    if len(parts) == 1:
        return parts[0]
    return RawSamples(
        seq=np.concatenate([part.seq for part in parts]),
        device_us=np.concatenate([part.device_us for part in parts]),
        codes=np.concatenate([part.codes for part in parts]),
        truth={
            name: np.concatenate([part.truth[name] for part in parts]) for name in parts[0].truth
        },
    )
