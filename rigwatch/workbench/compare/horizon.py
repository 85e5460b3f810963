"""Chooses the horizon: long enough for the model's dynamics, short enough for many windows.

Over a horizon much shorter than its time constants a model stays near each window's initial state,
and missing physics does not show. Over a long horizon errors accumulate and few windows remain for
statistics. The horizon therefore spans the slowest mode of the model that a recording shows: three
time constants, and at least two periods if it oscillates. An oscillation's time constant is that of
its decay: as long as the initial state rings on, it stands in for what is missing near the
resonance, and only what shifts the mean is left. A light damper rings for hundreds of periods, over
which the smallest error of the frequency adds up; a dozen are enough. To find the modes, the model
is fitted once over a horizon derived from the outputs.

Where a deviation grows by itself, as of a levitated or an inverted body under a controller, a long
horizon only shows how it grows, and its fits end anywhere: the horizon is a few e-foldings at most.

A drive that steps once a minute meets windows of a minute always at the same place. If that is a
window's beginning or end, the window's own initial state takes up all that a lag does after a step.
The horizon is then shortened until the steps fall inside the windows.
"""

from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.fit import Recording, filled
from rigwatch.physics.engine.score import autocorrelation, first_below
from rigwatch.wire.arrays import BoolArray, ComplexArray, FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, predicts_along_motion, prepare, scale_of_several
from rigwatch.workbench.fit import Fitted, eigenvalues, fit_base, given_eigenvalues, with_hold
from rigwatch.workbench.study import Study

SPANS = 3.0
"""Horizon over the slowest time constant."""
PERIODS = 2.0
"""Smallest number of periods in a horizon if the slowest motion oscillates."""
MOST_PERIODS = 12.0
"""The same at most."""
GROWTHS = 3.0
"""Longest horizon over the time in which a deviation grows e-fold."""
WINDOWS, FEWEST_WINDOWS = 10, 4
"""Minimum number of windows in the shortest recording, and if they would not span two periods."""
LIMITED = ", limited to a tenth of the shortest recording"
TWO_PERIODS = ", limited to two periods as the shortest recording holds few"
FEWEST = 20
"""Minimum number of samples in a window."""
UNCORRELATED = float(np.exp(-1))
"""Autocorrelation that defines an output's correlation time."""
BEGINNING, END = 0.1, 0.2
"""Shares of a window at its ends where a change of an input hardly shows."""
MOST_AT_ENDS = 0.6
"""Largest share of the inputs' changes there; half of it if they are spread evenly."""
SHORTENED = ", shortened as inputs would only change where windows begin or end"
SHORTER = (1.0, 0.9, 0.8, 0.7, 0.6)
"""Horizons that are tried, relative to the one chosen from the model."""


def with_horizon(study: Study) -> Study:
    """The study with a horizon, chosen from the data if its file gives none.

    Raises:
        ModelError: data do not suit the model.
    """
    given = study.file.horizon is not None or not study.model.states
    if given or study.model.rough or predicts_along_motion(study):
        return study
    data = prepare(_with_source(study, ""))
    shortest = _shortest(data)
    longest, least = shortest / WINDOWS, FEWEST * data.train.dt
    begin = float(np.clip(_from_correlation(data.train), least, max(longest, least)))
    begin = max(min(begin, _growth_limit(given_eigenvalues(study, data.train))), least)
    begin, shortened = _within_windows(begin, data)
    study = _with_source(study, f"how fast the outputs change{shortened}", begin)
    try:
        fitted, data = _fitted_once(study)
    except ModelError:
        return study
    modes = eigenvalues(fitted, data.train)
    slowest, most = _slowest(modes, shortest), _growth_limit(modes)
    if slowest is None:
        return study
    constant, name, swings = slowest
    if most < constant:
        name = f"a deviation that grows e-fold in {most / GROWTHS:.2g} s"
        constant, swings = most, 0.0
    # Within less than two periods an initial state stands in for what is missing.
    needed = min(swings, shortest / FEWEST_WINDOWS)
    chosen = float(np.clip(constant, least, max(longest, least, needed)))
    bound = "" if chosen >= constant else LIMITED if chosen <= longest else TWO_PERIODS
    chosen, shortened = _within_windows(chosen, data, needed)
    return _with_source(study, f"{name}{bound}{shortened}", chosen)


def with_horizon_of(study: Study, other: Study) -> Study:
    """The study with the horizon chosen for another instance of it."""
    if not other.horizon_from:
        return study
    file = structs.replace(
        study.file, horizon=other.file.horizon, half_windows=other.file.half_windows
    )
    return replace(study, file=file, horizon_from=other.horizon_from)


def _shortest(data: Data) -> float:
    """Length of the shortest recording [s]."""
    return min(length for r in (data.train, data.held_out) for length in r.parts) * data.train.dt


def _within_windows(horizon: float, data: Data, needed: float = 0.0) -> tuple[float, str]:
    """The horizon [s], shortened if inputs change only at the ends of its windows; words on it.

    It does not become shorter than `needed` [s].
    """
    shares = [share for share in SHORTER if share == 1 or share * horizon >= needed]

    def at_ends(share: float) -> float:
        return max(_share_at_ends(r, share * horizon) for r in (data.train, data.held_out))

    found = next((share for share in shares if at_ends(share) <= MOST_AT_ENDS), None)
    share = found or min(shares, key=at_ends)
    return share * horizon, SHORTENED if share < 1 else ""


def _share_at_ends(recording: Recording, horizon: float) -> float:
    """Share of the squared changes of the inputs near the ends of windows; 0 without changes."""
    length = max(round(horizon / recording.dt), 2)
    near, total = 0.0, 0.0
    size = np.maximum(np.std(recording.inputs, axis=0), 1e-300)
    for part in recording.slices:
        changes = np.sum(np.square(np.diff(recording.inputs[part] / size, axis=0)), axis=1)
        place = np.arange(1, len(changes) + 1) % length / length
        near += float(changes[(place < BEGINNING) | (place >= 1 - END)].sum())
        total += float(changes.sum())
    return near / total if total > 0 else 0.0


def _with_source(study: Study, source: str, horizon: float | None = None) -> Study:
    rounded = None if horizon is None else float(f"{horizon:.2g}")
    half = study.file.half_windows or rounded is not None
    file = structs.replace(study.file, horizon=rounded, half_windows=half)
    return replace(study, file=file, horizon_from=source)


def _fitted_once(study: Study) -> tuple[Fitted, Data]:
    """The model fitted to the training recordings, and these, cut to whole windows."""
    data = prepare(study)
    scale = scale_of_several(data.train)
    return fit_base(with_hold(study, data, scale), data, scale), data


def _slowest(found: ComplexArray, longest: float) -> tuple[float, str, float] | None:
    """Horizon for the slowest mode [s], its description, and two of its periods [s], 0 if none.

    None without a mode.
    Modes slower than the recording, for example integrators, are ignored.
    """
    rate = np.sort_complex(found.ravel())
    resolved = rate[np.abs(rate) * longest > 1]
    if not len(resolved):
        return None
    horizons = _spans(resolved)
    # Modes of all windows: the slowest that is not an outlier.
    slowest = float(np.quantile(horizons, 1 - 0.5 / found.shape[1]))
    at = resolved[np.argmin(np.abs(horizons - slowest))]
    if _oscillates(at):
        period, decay = 2 * np.pi / abs(at), 1 / abs(at.real)
        words = f"the model's period of {period:.2g} s that decays in {decay:.2g} s"
        return slowest, words, PERIODS * float(period)
    return slowest, f"the model's time constant of {slowest / SPANS:.2g} s", 0.0


def _growth_limit(found: ComplexArray) -> float:
    """Longest horizon for modes of which one grows [s]; infinite if none does in most windows."""
    growth = float(np.median(found.real.max(axis=1))) if found.size else 0.0
    return GROWTHS / growth if growth > 0 else np.inf


def _oscillates(rate: ComplexArray) -> BoolArray:
    """Whether modes swing more than they decay."""
    return np.asarray(np.abs(rate.imag) > np.abs(rate.real))


def _spans(rate: ComplexArray) -> FloatArray:
    """Horizon for each mode [s]."""
    constant = SPANS / np.maximum(np.abs(rate.real), 1e-300)
    period = 2 * np.pi / np.abs(rate)
    ringing = np.clip(constant, PERIODS * period, MOST_PERIODS * period)
    return np.asarray(np.where(_oscillates(rate), ringing, SPANS / np.abs(rate)))


def _from_correlation(recording: Recording) -> float:
    """Three times the correlation time of the slowest output [s]."""
    spans = [_correlation_time(filled(column)) for column in recording.outputs.T]
    return SPANS * max(spans) * recording.dt


def _correlation_time(signal: FloatArray) -> int:
    """Samples until the autocorrelation has fallen to 1/e."""
    return first_below(autocorrelation(signal - signal.mean(), len(signal)), UNCORRELATED)
