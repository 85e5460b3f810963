"""A study step by step: its model with no effect accepted, with the first, with the first two, …

Report and view show the same stages, each fitted to the same data.
"""

from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compiled import FloatArray
from rigwatch.physics.engine.fit import Recording, evaluate
from rigwatch.workbench.compare import Bench, Comparison, comparison, noise_floor
from rigwatch.workbench.fitted import fit_base
from rigwatch.workbench.ledger import check_data
from rigwatch.workbench.noise_floor import quiet_scale
from rigwatch.workbench.signals import prepare
from rigwatch.workbench.study import Study


@dataclass(frozen=True, eq=False)
class Stage:
    """The model with the first effects of the study.

    Attributes:
        added: the effect that came last, as "effect@port"; empty for the model alone.
        bench: the model, fitted.
        comparison: its errors, as `compare` gives them.
    """

    added: str
    bench: Bench
    comparison: Comparison

    @property
    def label(self) -> str:
        """What people call it."""
        return f"+ {self.added.split('@')[0].replace('_', ' ')}" if self.added else "model alone"


@dataclass(frozen=True, eq=False)
class Signals:
    """Measured and modelled outputs over the same samples.

    Attributes:
        time: from the recording's first sample [s], shape (n,).
        measured, modelled: shape (n, outputs); NaN where nothing valid was measured.
    """

    time: FloatArray
    measured: FloatArray
    modelled: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Measured less modelled, shape (n, outputs)."""
        return self.measured - self.modelled


def stages(study: Study) -> list[Stage]:
    """Every stage, the model alone first, the study's model as it is last.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    check_data(study)
    data = prepare(study)
    scale = quiet_scale(data.train) if data.train.outputs.shape[1] > 1 else None
    found = []
    for count in range(len(study.file.effects) + 1):
        effects = study.file.effects[:count]
        part = replace(study, file=structs.replace(study.file, effects=effects))
        base = fit_base(part, data, scale)
        bench = Bench(part, data, base, noise_floor(part, data, base))
        added = f"{effects[-1].effect}@{effects[-1].port}" if effects else ""
        found.append(Stage(added, bench, comparison(bench)))
    return found


def signals(stage: Stage, *, held_out: bool = True) -> Signals:
    """Outputs at every sample: of the recordings held out, or of those fitted to."""
    data, base = stage.bench.data, stage.bench.base
    whole = data.held_out if held_out else data.train
    recording = Recording(whole.dt, whole.inputs, whole.outputs)
    horizon = data.horizon if stage.bench.study.model.states else len(recording)
    residual = evaluate(base.train, recording, horizon, base.substeps).residuals
    flat = residual.reshape(-1, residual.shape[-1])
    measured = recording.outputs[: len(flat)]
    time = np.arange(len(flat), dtype=np.float64) * recording.dt
    return Signals(time, measured, measured - flat)
