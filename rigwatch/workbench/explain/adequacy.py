"""Judges the model before anything is built on it: does it describe the rig with nothing wrong?

A fit that has not converged, or a model of another machine, leaves a healthy recording far above
its noise. Whatever is then added to it explains some of that, and would be named with confidence.
"""

from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import METHODS, from_residual
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.study import Study

MOST = 5.0
"""Error on the healthy recording over its noise up to which a model can judge."""
ADVICE = "try another model or other starting values, or record a healthy run that excites it more"
VARIED = (
    "`rigwatch study base {study} --take enough` looks for variants of the model that do better"
)

UNTOLD = (
    "the model could not be checked on a healthy recording: record one with nothing wrong and list"
    " it under [[healthy]] in the study"
)


def inadequate(bench: Bench) -> Verdict | None:
    """The verdict where a study's model cannot judge, None where it can.

    A rough model is held against what it leaves of a healthy recording and needs no such check.
    """
    healthy, bare, model = bench.data.of_healthy, bench.bare, bench.study.model
    if healthy is None or bare is None or model.rough:
        return None
    noise = from_residual(bare.train, healthy.train, bench.study.file.period, healthy.horizon)
    ratio = noise.ratio(bare.train)
    if ratio <= MOST:
        return None
    channel = _worst(model, bare.train.rms / noise.rms)
    text = (
        f"the healthy recording is left at {ratio:.3g} times its noise (worst: {channel};"
        f" {METHODS[noise.method]}), expected at most {MOST:g}: {ADVICE}"
    )
    return Verdict("model_inadequate", None, (), (), text)


def with_base_offered(study: Study, found: Verdict) -> Verdict:
    """The verdict with the command that looks for a better base, where the model has variants."""
    if found.word != "model_inadequate" or not study.model.variants or not study.file.healthy:
        return found
    return replace(found, text=f"{found.text}; {VARIED.format(study=study.folder)}")


def unchecked(bench: Bench, found: Verdict) -> Verdict:
    """The verdict of a model along its measured motion that no healthy recording has told.

    What the model itself does wrong and a fault look alike then. So an effect is named only where
    it leaves nothing but what differs between repeated periods of the excitation; and where even
    the best leaves many times that, the model does not describe the rig.

    Args:
        bench: the study.
        found: the verdict on its ranking.
    """
    if bench.data.healthy is not None or not bench.data.along_motion:
        return found
    best = found.best.fitted if found.best is not None else None
    ratio = bench.floor.ratio((best or bench.base).held_out)
    periods = bench.floor.method == "periods"
    if ratio > MOST and found.word != "model_inadequate":
        text = (
            f"the best that is known leaves the held-out error at {ratio:.3g} times its noise"
            f" ({METHODS[bench.floor.method]}), expected at most {MOST:g}; {UNTOLD}"
        )
        return Verdict("model_inadequate", None, (), (), text)
    certain = periods and best is not None and bench.floor.reached(best.held_out)
    if found.word != "missing_effect" or certain:
        return found
    return replace(found, word="undetermined", text=f"{found.text}; {UNTOLD}")


def _worst(model: Model, ratios: FloatArray) -> str:
    """The output with the largest error over its noise."""
    return list(model.outputs)[int(np.argmax(ratios))]
