"""A scenario of the simulated rig as samples or as a session file, faster than real time.

The codes go through the same calibration and judgement as those of a device (`daq.conditioning`), so a simulated
session differs from a recorded one in nothing but its clock, which is exact.
"""

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from daq.adapter import RawBlock
from daq.conditioning import Conditioner
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.rig_config import ChannelSection, RigConfig
from rigwatch.wire.session import SessionWriter, run_info
from sim_plant.scenario import Scenario, ScenarioRun, load_scenario

BLOCK = 4096
"""Samples in a block, but for the last."""
EPOCH_NS = 1_767_225_600_000_000_000
"""Unix time of the first sample, 2026-01-01: simulated sessions are the same bytes every time [ns]."""


def simulate(
    scenario: Scenario | Path | str,
    channels: Sequence[ChannelSection],
    seed: int = 1,
    *,
    seconds: float | None = None,
    device: str = "rig",
    block: int = BLOCK,
) -> Iterator[SampleBlock]:
    """The samples of a scenario in blocks.

    Args:
        scenario: a scenario, or the file of one.
        channels: calibration of the simulated rig's channels.
        seed: of the sensors' noise; also makes the boot.
        seconds: length [s], the scenario's where None.
        device: the device's name in the blocks.
        block: samples in a block.

    Raises:
        ConfigError: the scenario is wrong, has no end and none is given, or has other channels.
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    run = ScenarioRun(loaded, seed)
    if len(channels) != len(run.rig.channels):
        expected = f"the simulated rig's {len(run.rig.channels)}"
        raise ConfigError(loaded.name, "channels", f"{len(channels)} channels", expected)
    total = _samples(loaded, run, seconds)
    boot = zlib.crc32(f"{loaded.name}/{seed}".encode())
    return _blocks(run, Conditioner(channels, device), boot, total, block)


def write_session(
    out: Path | str,
    scenario: Scenario | Path | str,
    config: RigConfig,
    *,
    seed: int = 1,
    seconds: float | None = None,
) -> int:
    """Write the session file `out` of a scenario; returns the number of samples.

    Raises:
        ConfigError: the scenario is wrong, or has no end and none is given.
        SessionError: the file cannot be written.
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    blocks = simulate(loaded, config.channels, seed, seconds=seconds, device=config.daq.name)
    notes = f"simulated rig, scenario {loaded.name}, seed {seed}"
    rate = loaded.plant.sample_rate
    with SessionWriter(out, run_info(config.rig.id, rate, t_ns=EPOCH_NS, notes=notes)) as writer:
        count = 0
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
