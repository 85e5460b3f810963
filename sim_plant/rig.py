"""The simulated rig: voltage in, raw codes of three channels out, with the true values.

`Rig` keeps all state between calls, so a run gives the same samples however it is divided.
Effects of `sim_plant.effects` can be set or ramped at any sample.

A cylinder integrates, and with a rod on one side only it creeps, so two measures hold it at mid
stroke for days. A one-time null adjustment of the valve makes 0 V balance the two areas
(`pneumatic.balance`). A slow centring loop adds to the commanded voltage: its own pick-off,
low-passed at 0.7 Hz, times -16 V/m, which gives a corner near 0.2 Hz and about 10 mV at 8 Hz. The
addition reaches the valve, so it is part of the measured voltage.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.errors import ModelError
from sim_plant import effects as table
from sim_plant.parameters import RigParameters, as_record
from sim_plant.pneumatic import DELAY_LINE, STATE_TYPE, TRUTH, advance_plant, balance
from sim_plant.sensor_kernel import (
    SENSOR_DELAY_LINE,
    SENSOR_STATE_TYPE,
    SENSOR_TRAITS_TYPE,
    advance_sensors,
)

CHANNELS = table.CHANNELS
"""Names of the three channels, in the order of their codes."""
RAMP_GRID = 8
"""Samples between updates of a ramp."""


@dataclass(frozen=True, slots=True)
class RawSamples:
    """The device's output for n samples, and the true values.

    Args:
        seq: number of each sample, int64 of shape (n,).
        device_us: the device's clock at each sample [us], int64 of shape (n,).
        codes: converter codes of voltage, position and acceleration, int16 of shape (n, 3).
        truth: true values in SI units by name (see `pneumatic.TRUTH`), float64 of shape (n,).
    """

    seq: NDArray[np.int64]
    device_us: NDArray[np.int64]
    codes: NDArray[np.int16]
    truth: dict[str, NDArray[np.float64]]

    def __len__(self) -> int:
        return int(self.seq.size)


@dataclass(slots=True)
class _Ramp:
    start: int
    stop: int
    low: float
    high: float

    def value(self, sample: int) -> float:
        if sample >= self.stop:
            return self.high
        # On the grid, not at the start of a call.
        sample = max(sample - sample % RAMP_GRID, self.start)
        return self.low + (self.high - self.low) * (sample - self.start) / (self.stop - self.start)


class Rig:
    """A servo-pneumatic rig with air-bearing mass, LVDT and accelerometer.

    Args:
        parameters: its parameters.
        seed: seed of the sensors' noise; the same seed gives the same samples.
    """

    def __init__(self, parameters: RigParameters, seed: int) -> None:
        self.parameters = parameters
        self.channels = CHANNELS
        self._record = as_record(parameters)
        self._dynamic, self._sensor = table.neutral_dynamic(), table.neutral_sensor()
        self._state = np.zeros(1, dtype=STATE_TYPE)
        self._state["P1"], self._state["P2"], self._null = balance(self._record)
        self._line = np.zeros(DELAY_LINE)
        self._traits = _traits(parameters)
        self._sensor_state = np.zeros(3, dtype=SENSOR_STATE_TYPE)
        self._sensor_lines = np.zeros((3, SENSOR_DELAY_LINE))
        normal, uniform = np.random.SeedSequence(seed).spawn(2)
        self._normal, self._uniform = np.random.default_rng(normal), np.random.default_rng(uniform)
        self._ramps: dict[str, _Ramp] = {}
        self._sample, self._origin = 0, 0

    @property
    def effects(self) -> dict[str, float]:
        """The current value of every effect, by name."""
        return {name: self._get(name) for name in table.EFFECTS}

    @property
    def next_seq(self) -> int:
        """Number of the next sample."""
        return self._sample - self._origin

    def restart_count(self) -> None:
        """Renumbers the next sample 0, device time 0; the motion continues."""
        self._origin = self._sample

    def set_effect(self, name: str, value: float, over_s: float = 0.0) -> None:
        """Sets the effect `name` to `value` from the next sample on, or ramps it over `over_s`.

        Raises:
            ModelError: there is no such effect, or it cannot have this value.
        """
        if wrong := table.complaint(name, value):
            raise ModelError(f"effect {name}: found {wrong[0]}, expected {wrong[1]}")
        self._ramps.pop(name, None)
        length = round(over_s * self.parameters.sample_rate)
        if length > 0:
            self._ramps[name] = _Ramp(self._sample, self._sample + length, self._get(name), value)
        else:
            self._put(name, value)

    def advance(self, voltage_command: NDArray[np.float64]) -> RawSamples:
        """Runs one sample per commanded voltage [V], held over the sample.

        Raises:
            ModelError: a voltage is not finite.
        """
        command = np.ascontiguousarray(voltage_command, dtype=np.float64)
        if not np.isfinite(command).all():
            raise ModelError("voltage command: found a value that is not finite")
        first = self.next_seq
        truth = np.empty((command.size, len(TRUTH)))
        codes = np.empty((command.size, 3), dtype=np.int16)
        start = 0
        while start < command.size:
            stop = min(start + self._stretch(), command.size)
            self._run(command[start:stop], truth[start:stop], codes[start:stop])
            start = stop
        return self._samples(first, truth, codes)

    def _stretch(self) -> int:
        """Number of samples that can run at once after updating ramps."""
        if not self._ramps:
            return np.iinfo(np.int64).max
        for name, ramp in list(self._ramps.items()):
            self._put(name, ramp.value(self._sample))
            if self._sample >= ramp.stop:
                del self._ramps[name]
        ends = [ramp.stop - self._sample for ramp in self._ramps.values()]
        return min([RAMP_GRID - self._sample % RAMP_GRID, *ends]) if ends else self._stretch()

    def _run(
        self, command: NDArray[np.float64], truth: NDArray[np.float64], codes: NDArray[np.int16]
    ) -> None:
        advance_plant(
            command,
            self._record,
            self._dynamic,
            self._null,
            self._state,
            self._line,
            self._sample,
            truth,
        )
        shape = (command.size, 3)
        advance_sensors(
            truth[:, [TRUTH.index("voltage"), TRUTH.index("x"), TRUTH.index("sensed_a")]],
            self._normal.standard_normal(shape),
            self._uniform.random(shape),
            self._traits,
            self._sensor,
            self._sensor_state,
            self._sensor_lines,
            self._sample,
            self.parameters.sample_rate,
            codes,
        )
        self._sample += command.size

    def _samples(
        self, first: int, truth: NDArray[np.float64], codes: NDArray[np.int16]
    ) -> RawSamples:
        seq = np.arange(first, first + len(codes), dtype=np.int64)
        microseconds = 1e6 / self.parameters.sample_rate * (1 + 1e-6 * self.parameters.clock_drift)
        device_us = np.rint(seq * microseconds).astype(np.int64)
        columns = {name: truth[:, column] for column, name in enumerate(TRUTH)}
        return RawSamples(seq, device_us, codes, columns)

    def _place(self, name: str) -> tuple[NDArray[np.void], str, int]:
        effect = table.EFFECTS[name]
        if effect.place in CHANNELS:
            row = CHANNELS.index(effect.place)
            return self._sensor, name.removeprefix(f"{effect.place}_"), row
        return self._dynamic, name, 0

    def _get(self, name: str) -> float:
        record, key, row = self._place(name)
        return float(record[key][row])

    def _put(self, name: str, value: float) -> None:
        record, key, row = self._place(name)
        record[key][row] = value


def _traits(p: RigParameters) -> NDArray[np.void]:
    """The three sensors as `SENSOR_TRAITS` records."""
    volts = p.volts_per_code
    rows = [
        (p.voltage_noise, np.inf, 0.0, 1.0, volts[0], 0.0),
        (p.lvdt_noise, p.lvdt_range, p.lvdt_resolution, p.lvdt_gain, volts[1], 0.0),
        (
            p.accelerometer_noise,
            p.accelerometer_range,
            0.0,
            p.accelerometer_gain,
            volts[2],
            p.accelerometer_corner,
        ),
    ]
    return np.array(rows, dtype=SENSOR_TRAITS_TYPE)
