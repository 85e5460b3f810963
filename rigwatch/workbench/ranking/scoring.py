"""Scores candidates along the fitted model: share of the residual each explains to first order."""

from collections.abc import Sequence

import numpy as np

from rigwatch.physics.engine.fit import Fit, windows
from rigwatch.physics.engine.score import (
    Candidate,
    Projector,
    Scores,
    alone,
    corrected_p_values,
    directions,
    possible,
    score,
    standings,
    trajectory,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted, nodes
from rigwatch.workbench.ranking.at_rest import begun_at_rest
from rigwatch.workbench.ranking.candidates import candidates
from rigwatch.workbench.ranking.ranked import Ranked, row_of
from rigwatch.workbench.ranking.separate_recordings import per_recording
from rigwatch.workbench.study import Study


def score_all(data: Data, base: Fitted, found: Sequence[Candidate]) -> Scores:
    """Scores of all candidates along the fitted base model.

    Args:
        data, base: the recordings and the fitted model.
        found: the candidates.
    """
    fitted, recording = _scored_fit(base), data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    moved, slopes = per_recording(_along, data, base, found)
    measured = np.isfinite(recording.outputs)[cut.starts[:, None] + np.arange(cut.length)]
    moved, slopes = moved * measured[..., None], slopes * measured[..., None]
    if recording.thinning:
        moved, slopes = recording.thinning.apply(moved), recording.thinning.apply(slopes)
    flat = (len(cut.starts), -1)
    moved = moved.reshape(*flat, len(found))
    slopes = slopes.reshape(*flat, slopes.shape[-1])
    m = len(base.compiled.system.free)
    residual = np.nan_to_num(fitted.residuals / fitted.scale).reshape(flat)
    fixed = Projector(slopes[..., :m], slopes[..., m:])
    return score(residual, moved, fixed, float(np.mean(residual**2)))


def _scored_fit(base: Fitted) -> Fit:
    """The fit that is the optimum for initial states as the score test projects them out.

    These are all states of each window.
    """
    return base.train.begun_anew or base.train


def _along(data: Data, base: Fitted, found: Sequence[Candidate]) -> tuple[FloatArray, FloatArray]:
    """Scaled directions of the candidates and slopes of the model, at every sample."""
    fitted, recording = _scored_fit(base), data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    substeps = nodes(base, recording)
    resting = begun_at_rest(
        base.compiled, recording, cut.starts,
        initial=fitted.initial, parameters=fitted.parameters, substeps=substeps,
    )  # fmt: skip
    at = trajectory(
        base.compiled, recording.inputs, recording.spacing, cut.starts, cut.length,
        initial=resting, parameters=fitted.parameters, substeps=substeps,
        begins=recording.begins, time=recording.time,
    )  # fmt: skip
    run = base.compiled.simulate(
        recording.inputs, recording.spacing, cut.starts, cut.length,
        initial=fitted.initial, parameters=fitted.parameters, substeps=substeps,
        begins=recording.begins, time=recording.time,
    )  # fmt: skip
    scale = fitted.scale[:, None]
    return directions(at, found) / scale, run.slopes / scale


def rank_all(study: Study, data: Data, base: Fitted) -> list[Ranked]:
    """Every effect at every port by its score, none of them fitted."""
    return scored(study, data, base, candidates(study, data.train), every=True)


def rank_only(study: Study, data: Data, base: Fitted, found: Sequence[Candidate]) -> Ranked:
    """The row of one effect at one port, regardless of its score; `found` are its shapes."""
    return scored(study, data, base, found, every=True)[0]


def scored(
    study: Study, data: Data, base: Fitted, found: Sequence[Candidate], *, every: bool = False
) -> list[Ranked]:
    """One row per effect and port, scored and not yet fitted, most promising first.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        found: the candidates; each row keeps the shape that matches the residual best.
        every: include effects whose strength would be outside its bounds.
    """
    if not found:
        return []
    scores = score_all(data, base, found)
    fitted = _scored_fit(base)
    p_values = corrected_p_values(scores, fitted.residuals / fitted.scale)
    strengths = scores.strength.tolist()
    allowed = [every or possible(c, at) for c, at in zip(found, strengths, strict=True)]
    ports = study.model.ports
    rows = [
        row_of(found[row.index], row, ports[found[row.index].port].kind)
        for row in standings([c.label for c in found], scores, p_values, allowed)
    ]
    for row in rows:
        row.p_alone = alone(row.p_value, int(np.sum(scores.score > 0)))
    return rows
