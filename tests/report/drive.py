"""A drive with friction, written as two sessions, and a study of it: small and deterministic."""

from pathlib import Path

import numpy as np

from monitor.model.model_file import (
    BandSection,
    DecisionSection,
    FrictionSection,
    InertiaPlant,
    NoiseSection,
    RigModel,
    WindowSection,
)
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import Study

RATE = 500.0
SAMPLES = 6000
MASS, VISCOUS, COULOMB, PUSH = 20.0, 60.0, 12.0, 3.0
STUDY = """
model = "emps-force"
[[train]]
session = "train.mcap"
[[held_out]]
session = "held_out.mcap"
[derive]
low_pass = 40.0
[derive.signals]
position = { channel = "position" }
velocity = { channel = "position", order = 1 }
acceleration = { channel = "position", order = 2 }
[thin]
factor = 10
edge = 15
"""
MODEL = RigModel(
    sample_rate=RATE,
    channels=("force", "position"),
    plant=InertiaPlant(mass=22.0, half_width=10),
    friction=FrictionSection(b=(1.0,), a=(1.0,), gamma=1.0),
    noise=NoiseSection(residual=0.02),
    window=WindowSection(length=500),
    decision=DecisionSection(settle=21, least_velocity=0.001),
    band=BandSection(low=(4.0, 20.0), high=(20.0, 100.0)),
)
"""What commissioning may have left: a mass that is somewhat wrong, friction not modelled."""


def block(seed: int, count: int = SAMPLES) -> SampleBlock:
    """Two sines, and the force that they take with the drive's friction and a constant push."""
    rng = np.random.default_rng(seed)
    time = np.arange(count) / RATE
    position, speed, acceleration = np.zeros(count), np.zeros(count), np.zeros(count)
    for size, rate in ((0.1, 0.4 + 0.05 * seed), (0.02, 1.3 - 0.05 * seed)):
        w, phase = 2 * np.pi * rate, rng.uniform(0, 6)
        position += size * np.sin(w * time + phase)
        speed += size * w * np.cos(w * time + phase)
        acceleration -= size * w**2 * np.sin(w * time + phase)
    force = MASS * acceleration + VISCOUS * speed + COULOMB * np.sign(speed) - PUSH
    columns = (
        Column("force", "N", force + rng.normal(0, 0.3, count), np.zeros(count, np.uint8)),
        Column("position", "m", position + rng.normal(0, 1e-7, count), np.zeros(count, np.uint8)),
    )
    at = np.arange(count, dtype=np.int64)
    return SampleBlock("rig", seed, 0, at * 2000, 10**18 + at * 2_000_000, columns)


def make_study(folder: Path) -> Study:
    """A new study of the drive in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed, name in ((1, "train"), (2, "held_out")):
        with SessionWriter(folder / f"{name}.mcap", run_info("drive", RATE), sync=False) as writer:
            writer.write(block(seed))
    (folder / "template.toml").write_text(STUDY)
    return create(folder / "drive", folder / "template.toml")
