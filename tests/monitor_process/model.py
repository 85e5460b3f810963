"""A model for the waves that the test publisher sends, small enough to be written down."""

from pathlib import Path

from monitor.model.model_file import (
    FrictionSection,
    NoiseSection,
    RigModel,
    TransferPlant,
    model_text,
)

MODEL = RigModel(
    sample_rate=256.0,
    channels=("voltage", "position", "acceleration"),
    plant=TransferPlant(b=(0.0, 0.0, 0.0043), a=(1.0,)),
    friction=FrictionSection(b=(1.0,), a=(1.0,), gamma=0.5),
    noise=NoiseSection(residual=0.05),
)


def write_model(folder: Path) -> Path:
    """The model as a file in `folder`."""
    path = folder / "model.toml"
    path.write_text(model_text(MODEL))
    return path


def monitor_section(folder: Path) -> str:
    """The section [monitor] of a rig with that model and a journal."""
    model, journal = write_model(folder), folder / "alarms.jsonl"
    return f'\n[monitor]\nmodel = "{model}"\njournal = "{journal}"\n'
