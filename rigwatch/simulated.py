"""A scenario of the simulated rig as samples or as a session file, faster than real time.

The codes go through the same calibration and judgement as those of a device (`daq.conditioning`),
so a simulated session differs from a recorded one in nothing but its clock, which is exact.
"""

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from daq.adapter import RawBlock
from daq.conditioning import Conditioner
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.new_file import new_file
from rigwatch.wire.rig_config import ChannelSection, RigConfig
from rigwatch.wire.session import SessionWriter, run_info
from sim_plant.parameters import RigParameters
from sim_plant.rig import CHANNELS
from sim_plant.scenario import Scenario, ScenarioRun, load_scenario

_UNITS = ("V", "m", "m/s^2")
BLOCK = 4096
"""Samples in a block, but for the last."""
EPOCH_NS = 1_767_225_600_000_000_000
"""Unix time of the first sample, 2026-01-01: a session comes out the same each time [ns]."""


def simulate(
    scenario: Scenario | Path | str,
    channels: Sequence[ChannelSection] | None = None,
    seed: int = 1,
    *,
    seconds: float | None = None,
    device: str = "rig",
    block: int = BLOCK,
) -> Iterator[SampleBlock]:
    """The samples of a scenario in blocks.

    Args:
        scenario: a scenario, or the file of one.
        channels: calibration of the simulated rig's channels, that of its sensors where None.
        seed: of the sensors' noise; also makes the boot.
        seconds: length [s], the scenario's where None.
        device: the device's name in the blocks.
        block: samples in a block.

    Raises:
        ConfigError: the scenario is wrong, has no end and none is given, or has other channels.
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    run = ScenarioRun(loaded, seed)
    channels = sensor_channels(loaded.plant) if channels is None else channels
    if len(channels) != len(run.rig.channels):
        expected = f"the simulated rig's {len(run.rig.channels)}"
        raise ConfigError(loaded.name, "channels", f"{len(channels)} channels", expected)
    total = _samples(loaded, run, seconds)
    boot = zlib.crc32(f"{loaded.name}/{seed}".encode())
    return _blocks(run, Conditioner(channels, device), boot, total, block)


def sensor_channels(plant: RigParameters) -> tuple[ChannelSection, ...]:
    """The calibration that the simulated rig's sensors have in truth."""
    gains = plant.si_per_code.tolist()
    named = zip(CHANNELS, _UNITS, gains, strict=True)
    return tuple(ChannelSection(name=name, unit=unit, gain=gain) for name, unit, gain in named)


def write_session(
    out: Path | str,
    scenario: Scenario | Path | str,
    config: RigConfig | None = None,
    *,
    seed: int = 1,
    seconds: float | None = None,
) -> int:
    """Write the session file `out` of a scenario; returns the number of samples.

    `config` gives the calibration and the names of rig and device; without it they are those of
    the simulated sensors, "simulated" and "rig".

    Raises:
        ConfigError: the scenario is wrong, or has no end and none is given.
        SessionError: the file cannot be written.
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    channels, device = (config.channels, config.daq.name) if config else (None, "rig")
    blocks = simulate(loaded, channels, seed, seconds=seconds, device=device)
    notes = f"simulated rig, scenario {loaded.name}, seed {seed}"
    rate = loaded.plant.sample_rate
    rig = config.rig.id if config else "simulated"
    run, count = run_info(rig, rate, t_ns=EPOCH_NS, notes=notes), 0
    with new_file(Path(out)) as part, SessionWriter(part, run, sync=False) as writer:
        for block in blocks:
            writer.write(block)
            count += len(block)
    return count


def _samples(scenario: Scenario, run: ScenarioRun, seconds: float | None) -> int:
    if seconds is not None:
        return round(seconds * scenario.plant.sample_rate)
    if run.samples is None:
        raise ConfigError(scenario.name, "duration_s", "inf", "an end, or the seconds wanted")
    return run.samples


def _blocks(
    run: ScenarioRun, conditioner: Conditioner, boot: int, total: int, size: int
) -> Iterator[SampleBlock]:
    done = 0
    while done < total:
        samples = run.advance(min(size, total - done))
        n = len(samples)
        raw = RawBlock(boot, samples.seq, samples.device_us, samples.codes, np.zeros(n, np.int64))
        yield conditioner.condition(raw, EPOCH_NS + samples.device_us * 1000)
        done += n
