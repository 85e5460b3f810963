"""A rough model along the measured motion, with what a healthy rig does beyond it learned.

A rough model, such as a linear black box, drifts and leaves much when it is simulated on its own.
Driven by the measured motion it predicts the force balance alone (see `measured_motion`), and a
missing force shows there at once, whatever the excitation. What it still leaves of a healthy rig
is learned from the healthy recordings as a function of the motion and of hidden states that follow
it: more and more terms (`learned_terms`), for as long as windows that were not fitted gain by them.

Then all of it is fixed, so that a fit to another recording cannot swallow a fault. The recordings
need no common period and no common excitation; but motion beyond the healthy one is said.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import Model, has_hidden_states
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, along_motion, port_sizes
from rigwatch.workbench.fit.fitted_model import Fitted, fit_model
from rigwatch.workbench.fit.healthy_parameters import with_known
from rigwatch.workbench.fit.intervals import covariance
from rigwatch.workbench.fit.learned_terms import LEARNED, with_friction, with_products
from rigwatch.workbench.study import Kept, Study

LONGER = 4
"""Windows along the motion over the study's: nothing drifts, and hidden states settle once."""
FIT_SHARE = 0.6
"""Share of the healthy recording that terms are fitted to; the rest decides on them."""
WORTH = 0.03
"""Share by which the error of windows that were not fitted must fall for more terms."""
SUBSTEPS = 4
"""Integration steps a sample at least: the hidden states are as fast as a valve."""
LARGER = 1.2
"""Motion over the healthy one under which a model must still stay bounded."""
TOGETHER, BOUNDED = 0.02, 3.0
"""How far two runs may be apart at last, and how large they may become, in sizes of the output."""

Sizes = Mapping[str, Mapping[str, float]]
Step = Callable[[Model, Sizes], Model]
STEPS: Mapping[str, Step] = {
    "friction": with_friction,
    "products of motion": lambda model, sizes: with_products(model, sizes, 3, ("flow",)),
    "products of motion and drive": lambda model, sizes: with_products(model, sizes, 3),
    "products of two": lambda model, sizes: with_products(model, sizes, 2),
}
"""What is tried in turn, by what it is called."""


@dataclass(frozen=True, eq=False)
class Learned:
    """What a healthy recording has taught.

    Attributes:
        model: along the measured motion, its learned parameters free.
        fitted: it, fitted to the healthy recording.
        steps: what was added.
    """

    model: Model
    fitted: Fitted
    steps: tuple[str, ...]


def learns_from_healthy(study: Study) -> bool:
    """Whether a study's model is rough and learns along the measured motion what it leaves."""
    if study.file.prediction != "auto":
        return False
    return study.model.rough and has_hidden_states(study.model)


def with_healthy_remainder(study: Study, data: Data) -> tuple[Study, Data]:
    """The study's rough model along the measured motion, with its remainder, and its recordings.

    Args:
        study: as it was opened.
        data: its recordings.

    Raises:
        ModelError: there is no healthy recording, or none of the model's states is measured.
    """
    name = study.model.name
    if data.healthy is None:
        raise ModelError(
            f"{name}: found no healthy recording, expected one, as this model learns from it what a"
            " healthy rig does"
        )
    horizon = LONGER * data.horizon
    study, driven = along_motion(study, data)
    healthy = driven.healthy
    assert healthy is not None
    every = (driven.train, driven.held_out, healthy)
    lengths = [n for recording in every for n in recording.parts or (len(recording),)]
    whole = all(length % horizon == 0 for length in lengths)
    driven = replace(driven, horizon=horizon if whole else data.horizon)
    study = replace(study, file=structs.replace(study.file, substeps=SUBSTEPS))
    found = learn(study, healthy, driven.horizon)
    kept = tuple(found.fitted.compiled.system.free)
    told = Kept(kept, covariance(found.fitted.train)[0])
    alone = replace(driven, train=healthy, held_out=healthy, healthy=None)
    told = with_known(told, alone, found.fitted)
    # What the file says to start from has been used, and must not move what was learned.
    file = structs.replace(study.file, start={})
    study = replace(study, file=file, model=_fixed(found.model, found.fitted), kept=told)
    return study, replace(driven, remarks=(*driven.remarks, _said(name, found)))


def learn(study: Study, healthy: Recording, horizon: int) -> Learned:
    """The model along the measured motion with the terms that a healthy recording is worth.

    Args:
        study: with its model along the measured motion.
        healthy: recording for the model along the measured motion.
        horizon: samples of a window.
    """
    bare = _loose(study.model)
    both = _split(healthy, horizon)
    sizes = port_sizes(bare, healthy)
    model, steps = bare, list[str]()
    best = _fit(study, model, both, study.file.start)
    for name, step in STEPS.items():
        larger = step(model, _of_states(sizes, best))
        if larger is model:
            continue
        tried = _tried(study, larger, both, best.train.values())
        if tried is None or tried.held_out_error > (1 - WORTH) * best.held_out_error:
            continue
        if _forgets(tried, healthy):
            model, best = larger, tried
            steps.append(name)
    whole = Data(healthy, healthy, None, horizon, ())
    return Learned(model, _fit(study, model, whole, best.train.values()), tuple(steps))


def _forgets(fitted: Fitted, healthy: Recording) -> bool:
    """Whether the model stays where it belongs under a motion larger than any that was fitted.

    Products may hold several equilibria, and one that nobody has seen is met by the next recording.
    So two runs from different states must come together, and stay as large as the output.
    """
    states = len(fitted.compiled.system.states)
    starts = np.stack([np.zeros(states), _largest_states(fitted)])
    run = fitted.compiled.simulate(
        LARGER * healthy.inputs, healthy.dt, np.zeros(2, np.int64), len(healthy), initial=starts,
        parameters=fitted.train.parameters, substeps=fitted.substeps,
    )  # fmt: skip
    later = run.outputs[:, len(healthy) // 2 :]
    size = np.nanstd(healthy.outputs, axis=0)
    apart = np.sqrt(np.mean((later[0] - later[1]) ** 2, axis=0))
    reached = np.sqrt(np.mean(later**2, axis=(0, 1)))
    return bool(np.all(apart < TOGETHER * size) and np.all(reached < BOUNDED * size))


def _largest_states(fitted: Fitted) -> FloatArray:
    return np.asarray(np.max(np.abs(fitted.train.initial), axis=0))


def _tried(study: Study, model: Model, both: Data, start: Mapping[str, float]) -> Fitted | None:
    """A larger model's fit; None where it diverges (NaN or infinite)."""
    try:
        return _fit(study, model, both, start)
    except ModelError:
        return None


def _fit(study: Study, model: Model, data: Data, start: Mapping[str, float]) -> Fitted:
    own = {name: value for name, value in start.items() if name in model.parameters}
    return fit_model(replace(study, model=model), data, (), own)


def _of_states(sizes: Sizes, fitted: Fitted) -> Sizes:
    """Sizes of the ports' variables, of hidden states as a fit has found them."""
    found = {port: dict(own) for port, own in sizes.items()}
    model, train = fitted.compiled.system.model, fitted.train
    states = list(model.states)
    for port, own in found.items():
        for name, variable in model.ports[port].variables.items():
            if variable.expression in states:
                column = train.initial[:, states.index(variable.expression)]
                own[name] = float(np.sqrt(np.mean(column**2))) or 1.0
    return found


def _split(healthy: Recording, horizon: int) -> Data:
    """Windows that are fitted, and those that decide."""
    windows = len(healthy) // horizon
    cut = max(round(FIT_SHARE * windows), 1) * horizon
    if cut >= len(healthy):
        return Data(healthy, healthy, None, horizon, ())
    first, rest = (
        Recording(healthy.dt, healthy.inputs[part], healthy.outputs[part])
        for part in (slice(cut), slice(cut, None))
    )
    return Data(first, rest, None, horizon, ())


def _loose(model: Model) -> Model:
    """The model with all that a healthy recording may tell free, but what forces divide by."""
    parameters = {
        name: structs.replace(p, fixed=not p.kept, kept=p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)


def _fixed(model: Model, fitted: Fitted) -> Model:
    """The model with the values of a fit, none of them free any more."""
    values = fitted.train.values()
    parameters = {
        name: structs.replace(p, value=values[name], fixed=True)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)


def _said(name: str, found: Learned) -> str:
    more = f", with {' and '.join(found.steps)}" if found.steps else ""
    count = sum(n.startswith(LEARNED) for n in found.fitted.compiled.system.free)
    return (
        f"{name}: learned along the measured motion of the healthy recording{more}"
        f" ({count} terms); it leaves {found.fitted.train_error:.3g} there"
    )
