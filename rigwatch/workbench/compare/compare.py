"""Compares the model of a study with its recordings: errors, noise floor, parameters."""

from dataclasses import dataclass, field, replace

import numpy as np

from rigwatch.physics.engine.search import Convergence
from rigwatch.workbench.compare.given_values import far_from_given
from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data import METHODS
from rigwatch.workbench.fit import Value, as_written, free_run, profile, values
from rigwatch.workbench.study import Held, Study, told, told_unit


@dataclass(frozen=True)
class Channel:
    """Errors of one output, in its SI unit; the free run is one simulation of the held-out data.

    Texts tell them in `told_in`.
    """

    train_error: float
    held_out_error: float
    noise_floor: float
    unit: str
    free_run_error: float | None = None
    told_in: str = ""

    def told(self, error: float) -> float:
        """One of the errors in the unit in which it is told."""
        return told(error, self.told_in)


@dataclass(frozen=True)
class Comparison:
    """Errors and parameters of a fitted model.

    Attributes:
        train_error, held_out_error, noise_floor: over all channels, in `unit`.
        unit: that of the channel in SI if there is only one, otherwise "× channel noise".
        noise_from: method of the noise floor, in words.
        channels: by output.
        parameters: by name, in the units of the model's and effects' files.
        effects: accepted effects, as "effect@port".
        remarks: notes for the user.
        hold: hold of each input between samples, by name.
        convergence: how the fit of the model ended.
        told_in: unit in which texts tell the errors.
    """

    train_error: float
    held_out_error: float
    noise_floor: float
    unit: str
    noise_from: str
    channels: dict[str, Channel]
    parameters: dict[str, Value]
    effects: list[str]
    remarks: list[str]
    hold: dict[str, Held] = field(default_factory=dict)
    convergence: Convergence | None = None
    told_in: str = ""

    def told(self, error: float) -> float:
        """An error over all channels in the unit in which it is told."""
        return told(error, self.told_in)


def compare(study: Study, *, profiled: bool = False) -> Comparison:
    """Errors, noise floor and parameters of the study's current model.

    Args:
        study: the study.
        profiled: compute intervals from the profile likelihood, which takes many fits.
    """
    bench = open_bench(study)
    found = comparison(bench)
    if not profiled:
        return found
    intervals = as_written(profile(bench.base, bench.data.train), bench.base.compiled.system)
    return replace(found, parameters=intervals)


def comparison(bench: Bench) -> Comparison:
    """`compare` for an open bench."""
    base, floor = bench.base, bench.floor
    outputs = bench.study.model.outputs
    channels = {
        name: Channel(float(a), float(b), float(c), output.unit, free, told_unit(output))
        for (name, output), a, b, c, free in zip(
            outputs.items(), base.train.rms, base.held_out.rms, floor.rms, _free(bench), strict=True
        )
    }
    alone = len(channels) == 1
    total = floor.rms[0] if alone else np.sqrt(np.mean((floor.rms / base.train.scale) ** 2))
    found = values(base.train, added_variances(bench.study, bench.data, bench.bare, base))
    written = as_written(found, base.compiled.system)
    weak = [f"{n}: {value.note}" for n, value in found.items() if value.note and value.interval]
    return Comparison(
        base.train_error,
        base.held_out_error,
        float(total),
        base.error_unit,
        METHODS[floor.method],
        channels,
        written,
        [f"{a.effect}@{a.port}" for a in bench.study.file.effects],
        [*bench.data.remarks, *weak, *far_from_given(bench, written), *_unchanging(bench)],
        dict(bench.study.holds),
        base.convergence or (bench.study.kept.convergence if bench.study.kept else None),
        base.told_in,
    )


def _unchanging(bench: Bench) -> list[str]:
    """Remarks on inputs that could change, and never do in the recordings of one kind."""
    found, data, model = [], bench.data, bench.study.model
    for use, recording in (("training", data.train), ("held out", data.held_out)):
        still = np.ptp(recording.inputs, axis=0) == 0
        constant = {name for name, at in zip(model.inputs, still, strict=True) if at}
        if names := [name for name in model.driving() if name in constant]:
            found.append(
                f"{use}: {', '.join(names)} never changes; what it does there is a constant"
            )
    return found


def _free(bench: Bench) -> list[float | None]:
    """Errors of a free run; none without states, along the motion, or for several recordings."""
    model, file = bench.study.model, bench.study.file
    if not model.states or bench.data.along_motion or len(file.held_out) > 1:
        return [None] * len(model.outputs)
    return [float(error) for error in free_run(bench.base, bench.data.held_out)]
