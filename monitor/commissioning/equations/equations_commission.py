"""Commissioning of the observer: healthy recordings in, one model file out.

    chirp, healthy ─▶ motion ─▶ sensor behind the balance ─▶ parameters of the equations ─▶
    remainder ─▶ range of motion, healthy spread and limits

The equations are fitted to the first part of each recording; their residual on the rest decides
whether they describe the rig. No recording of a fault is needed.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np

from monitor.commissioning.end_stop import hit_stops
from monitor.commissioning.equations.equations_model import equations_model
from monitor.commissioning.equations.fitted_equations import (
    fitted_equations,
    half_width_of,
    motion_of,
)
from monitor.commissioning.equations.healthy_remainder import healthy_remainder
from monitor.commissioning.unhealthy import check_moves
from monitor.model import (
    RigModel,
)
from monitor.observer import (
    base_model,
    force_port,
    layout_of,
)
from monitor.signals import Recording
from rigwatch.physics.engine.equations import measured_states
from rigwatch.wire.errors import ModelError

EQUATIONS = "servo-pneumatic"
"""Shipped model that is fitted by default."""
CORNER = 2.0
"""Corner of the high-pass of all judged signals [Hz]."""


def commission_equations(
    recordings: Sequence[Recording],
    name: str = EQUATIONS,
    say: Callable[[str], None] = lambda _: None,
    stated: Mapping[str, float] | None = None,
) -> RigModel:
    """The model file of the observer scheme.

    Args:
        recordings: chirps and healthy ones; others are not used.
        name: of a shipped model, or its file.
        say: called with one line at each step.
        stated: parameters that are known, in SI.

    Raises:
        ModelError: there is no healthy recording, rates differ, a recording is short or at rest,
            the equations do not describe the rig, or a healthy recording is not healthy.
    """
    used = [one for one in recordings if one.role != "friction"]
    if not any(one.role == "healthy" for one in used):
        raise ModelError("commissioning: found no healthy recording, expected at least one")
    rates = {one.sample_rate for one in used}
    if len(rates) != 1:
        raise ModelError(f"commissioning: found sample rates {sorted(rates)} Hz, expected one")
    rate = rates.pop()
    check_moves(used, [state.channel for state in measured_states(base_model(name))])
    known = stated or {}
    readings, seem = [False] * len(used), _seem_to_jitter(used, name, rate)
    if seem == readings:
        return _commissioned(used, name, rate, readings, known, say=say)
    say("the drive's steps may jitter: fitting without and with it")
    return _quieter(
        partial(_commissioned, used, name, rate, jitters, known, say=say)
        for jitters in (readings, seem)
    )


def _seem_to_jitter(used: Sequence[Recording], name: str, rate: float) -> list[bool]:
    """Of which recordings the inputs' steps seem to jitter, which the motion must confirm."""
    layout = layout_of(base_model(name), force_port(base_model(name)))
    lag = half_width_of(name)
    seem = []
    for one in used:
        readings, in_force = (
            motion_of(one, layout, lag, rate, 0.0, each) for each in (False, True)
        )
        seem.append(not np.array_equal(readings, in_force))
    return seem


def _quieter(attempts: Iterable[Callable[[], RigModel]]) -> RigModel:
    """The model with the smaller healthy residual.

    Raises:
        ModelError: of the first attempt, if all fail.
    """
    made: list[RigModel] = []
    failed: list[ModelError] = []
    for attempt in attempts:
        try:
            made.append(attempt())
        except ModelError as error:
            failed.append(error)
    if not made:
        raise failed[0]
    return min(made, key=lambda model: model.noise.residual)


def _commissioned(
    used: Sequence[Recording],
    name: str,
    rate: float,
    jitters: Sequence[bool],
    stated: Mapping[str, float],
    *,
    say: Callable[[str], None],
) -> RigModel:
    """The model.

    Args:
        used: recordings.
        name: of the equations.
        rate: sample rate [Hz].
        jitters: of which recordings the inputs' steps jitter.
        stated: parameters that are known, in SI.
        say: called with one line at each step.

    Raises:
        ModelError: the equations do not describe the rig, or a recording is not healthy.
    """
    say("1 of 3: parameters of the equations")
    plant = fitted_equations(used, name, CORNER, rate, jitters, stated, say)
    say("2 of 3: what the healthy rig leaves of them")
    try:
        parts, roles, remainder, scheme = healthy_remainder(used, plant, rate, jitters)
    except ModelError as error:
        stops = hit_stops(used, base_model(name))
        raise ModelError(f"{stops} ({error})" if stops else str(error)) from error
    say("3 of 3: limits of the healthy rig")
    return equations_model(used, plant, remainder, scheme, parts, roles, rate)
