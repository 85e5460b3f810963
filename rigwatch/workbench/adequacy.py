"""Judges the model before anything is built on it: does it describe the rig with nothing wrong?

A fit that has not converged, or a model of another machine, leaves a healthy recording far above
its noise. Whatever is then added to it explains some of that, and would be named with confidence.
"""

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import METHODS, from_residual

MOST = 5.0
"""Error on the healthy recording over its noise up to which a model can judge."""
ADVICE = "try another model or other starting values, or record a healthy run that excites it more"


def inadequacy(bench: Bench) -> str:
    """Why a study's model cannot judge, in a sentence; empty where it can.

    A rough model is held against what it leaves of a healthy recording and needs no such check.
    """
    healthy, bare, model = bench.data.of_healthy, bench.bare, bench.study.model
    if healthy is None or bare is None or model.rough:
        return ""
    noise = from_residual(bare.train, healthy.train, bench.study.file.period, healthy.horizon)
    ratio = noise.ratio(bare.train)
    if ratio <= MOST:
        return ""
    channel = _worst(model, bare.train.rms / noise.rms)
    return (
        f"the healthy recording is left at {ratio:.3g} times its noise (worst: {channel};"
        f" {METHODS[noise.method]}), expected at most {MOST:g}: {ADVICE}"
    )


def _worst(model: Model, ratios: FloatArray) -> str:
    """The output with the largest error over its noise."""
    return list(model.outputs)[int(np.argmax(ratios))]
