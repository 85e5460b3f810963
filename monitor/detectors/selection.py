"""Builds the detectors that a configuration names from the model file's healthy reference.

The model file holds one averaged period of the healthy rig under each excitation, and the scatter
of single periods. Repeated, with that scatter added as noise from a fixed seed, they are the
healthy recordings for the calibration: the same model file always gives the same detectors.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from monitor.detectors.detector import Channels, Detector
from monitor.detectors.registry import detector_kind
from monitor.model import ReferenceSection, RigModel, TransferPlant
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ConfigError

FRICTION = "friction"
"""The friction scheme: always runs, and is not a detector of this folder."""
HEALTHY_SECONDS = 40.0
SEED = 1


def detectors_of(names: Iterable[str], model: RigModel, file: Path | str) -> tuple[Detector, ...]:
    """The detectors called `names`, without the friction scheme.

    Args:
        names: as in monitor.detectors.
        model: the rig's model.
        file: the configuration, for errors.

    Raises:
        ConfigError: the model has no transfer function or no healthy reference to work with.
    """
    wanted = [detector_kind(name) for name in names if name != FRICTION]
    if not wanted:
        return ()
    if not isinstance(model.plant, TransferPlant) or not model.reference:
        found = "a model without transfer function or healthy reference"
        raise ConfigError(file, "monitor.detectors", found, f"only {FRICTION!r} with this model")
    function, healthy = model.plant.function(), healthy_signals(model)
    acceleration = model.channels[2] if len(model.channels) > 2 else ""
    channels = Channels(model.channels[0], model.channels[1], acceleration)
    rate = model.sample_rate
    return tuple(
        kind.make(function, kind.calibrate(function, healthy, rate), channels, rate)
        for kind in wanted
    )


def healthy_signals(model: RigModel) -> Sequence[FloatArray]:
    """A healthy recording for each reference: input, output and acceleration, shape (n, 3 or 2)."""
    rng = np.random.default_rng(SEED)
    width = min(len(model.channels), 3)
    noise = np.array([model.noise.voltage, model.noise.position, model.noise.residual])[:width]
    found = []
    for reference in model.reference:
        period = np.column_stack(_columns(reference))[:, :width]
        repeats = int(np.ceil(HEALTHY_SECONDS * model.sample_rate / len(period)))
        signals = np.tile(period, (repeats, 1))
        found.append(signals + noise * rng.standard_normal(signals.shape))
    return found


def _columns(reference: ReferenceSection) -> tuple[FloatArray, ...]:
    names = ("voltage", "position", "acceleration")
    return tuple(np.array(getattr(reference, name)) for name in names)
