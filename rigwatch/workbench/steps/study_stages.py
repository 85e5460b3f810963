"""A study step by step: its model without effects, with the first, with the first two, …

Report and browser show the same stages, each fitted to the same data.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.fit import Recording, evaluate
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import (
    Bench,
    Comparison,
    bench_of,
    comparison,
    prepared,
)
from rigwatch.workbench.study import Study


@dataclass(frozen=True, eq=False)
class Stage:
    """The model with the first effects of the study.

    Attributes:
        added: the effect added last, as "effect@port"; empty for the model alone.
        bench: the fitted model with its data.
        comparison: its errors, as returned by `compare`.
    """

    added: str
    bench: Bench
    comparison: Comparison

    @property
    def label(self) -> str:
        """Name shown to users."""
        return f"+ {self.added.split('@')[0].replace('_', ' ')}" if self.added else "model alone"


@dataclass(frozen=True, eq=False)
class Signals:
    """Measured and modelled outputs over the same samples.

    Attributes:
        time: from the recording's first sample [s], shape (n,).
        measured, modelled: shape (n, outputs); NaN for invalid samples.
    """

    time: FloatArray
    measured: FloatArray
    modelled: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Measured minus modelled, shape (n, outputs)."""
        return self.measured - self.modelled


def stages(study: Study) -> list[Stage]:
    """Every stage, from the model alone to the study's current model.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    study, data, scale = prepared(study)
    effects, found = study.file.effects, []
    for count in range(len(effects) + 1):
        bench = bench_of(study.with_effects(effects[:count]), data, scale)
        added = f"{effects[count - 1].effect}@{effects[count - 1].port}" if count else ""
        found.append(Stage(added, bench, comparison(bench)))
    return found


def signals(stage: Stage, *, held_out: bool = True) -> Signals:
    """Measured and modelled outputs at every sample of the held-out or training recordings."""
    data, base = stage.bench.data, stage.bench.base
    whole = data.held_out if held_out else data.train
    recording = Recording(
        whole.dt, whole.inputs, whole.outputs, parts=whole.parts, spacings=whole.spacings,
        begun=whole.begun,
    )  # fmt: skip
    horizon = data.horizon if stage.bench.study.model.states else len(recording)
    residual = evaluate(base.train, recording, horizon, base.substeps).residuals
    flat = residual.reshape(-1, residual.shape[-1])
    measured = recording.outputs[: len(flat)]
    time = np.concatenate([[0.0], np.cumsum(recording.spacing)[: len(flat) - 1]])
    return Signals(time, measured, measured - flat)
