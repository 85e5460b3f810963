"""Signals of the simulated rig, the model fitted to its chirp, and blocks of them."""

from functools import cached_property
from pathlib import Path

import numpy as np
from msgspec import structs

from monitor.detectors import DetectorKind
from monitor.detectors.detector import Channels, Detector
from rigwatch.physics.transfer.frequency_fit import fit_transfer_function
from rigwatch.physics.transfer.frequency_response import frequency_response
from rigwatch.physics.transfer.transfer_function import TransferFunction
from rigwatch.wire.messages.message_types import Column, SampleBlock
from sim_plant.scenario import Event, Scenario, ScenarioRun, load_scenario

FOLDER = Path(__file__).parents[2] / "configs" / "scenarios"
RATE = 256.0
CHANNELS = Channels()
NAMES = (("voltage", "V"), ("position", "m"), ("acceleration", "m/s^2"))


def recorded(scenario: Scenario, seconds: float, seed: int) -> np.ndarray:
    """Calibrated voltage, position and acceleration, shape (n, 3)."""
    plant = scenario.plant
    codes = ScenarioRun(scenario, seed).advance(int(seconds * RATE)).codes
    gains = np.array([1.0, plant.lvdt_gain, plant.accelerometer_gain])
    return codes * (np.array(plant.volts_per_code) / gains)


def block(signals: np.ndarray, first: int = 0, quality: np.ndarray | None = None) -> SampleBlock:
    """A block of the signals, whose first sample has the number `first`."""
    t_ns = (first + np.arange(len(signals), dtype=np.int64)) * 3_906_250
    flags = np.zeros(signals.shape, np.uint8) if quality is None else quality
    columns = tuple(
        Column(name, unit, signals[:, i].copy(), flags[:, i].copy())
        for i, (name, unit) in enumerate(NAMES)
    )
    return SampleBlock("rig", 3, first, t_ns // 1000, t_ns, columns)


class SimulatedRig:
    """The rig under an 8 Hz sine of 1.4 V."""

    @cached_property
    def function(self) -> TransferFunction:
        """Fourth-order model from the chirp (5.16)."""
        chirp = recorded(load_scenario(FOLDER / "commissioning_chirp.toml"), 96.0, seed=1)
        response = frequency_response(chirp[:, 0], chirp[:, 1], RATE)
        return fit_transfer_function(response.band(0.5, 12.0, 0.6))

    @cached_property
    def scenario(self) -> Scenario:
        return load_scenario(FOLDER / "healthy_sine_8hz_1v4.toml").healthy()

    @cached_property
    def reference(self) -> np.ndarray:
        """A healthy minute."""
        return recorded(self.scenario, 60.0, seed=3)

    def with_fault(self, effect: str, value: float, seconds: float, seed: int) -> np.ndarray:
        """The effect comes half way."""
        event = Event(at_s=seconds / 2, effect=effect, value=value)
        return recorded(structs.replace(self.scenario, events=(event,)), seconds, seed)

    def detector(self, kind: DetectorKind) -> Detector:
        """Calibrated with the healthy minute."""
        figures = kind.calibrate(self.function, [self.reference], RATE)
        return kind.make(self.function, figures, CHANNELS, RATE)
