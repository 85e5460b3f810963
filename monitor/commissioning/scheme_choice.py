"""Chooses the monitoring scheme that describes a rig's healthy recordings.

If equations describe held-out healthy data, they are run along the motion, which works for any
excitation. Otherwise the thesis's scheme is used, which needs no equations of the rig, provided
that it arms on the healthy recordings and raises no alarm there.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from msgspec.structs import replace

from monitor.commissioning.commission import CommissionSettings, commission
from monitor.commissioning.equations import EQUATIONS, commission_equations
from monitor.commissioning.steady_signals import CHANNELS
from monitor.model import EquationsPlant, RigModel, SchemeSection
from monitor.observer import base_model, force_port, layout_of
from monitor.pipeline import Monitor
from monitor.signals import DEPARTURE, DRY_FRICTION, OTHER_FAULT, STICTION, Recording
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import Column, SampleBlock

Scheme = Literal["auto", "transfer", "equations"]
FAULTS = (DEPARTURE, DRY_FRICTION, STICTION, OTHER_FAULT)
LEAST_ARMED = 0.5
"""Share of a healthy recording over which a scheme must be armed."""


def channels_of(scheme: Scheme, equations: str = EQUATIONS) -> set[str]:
    """The channels that a scheme needs.

    Raises:
        RigwatchError: there is no such model of equations, or it cannot be watched.
    """
    found = set() if scheme == "equations" else set(CHANNELS)
    if scheme != "transfer":
        base = base_model(equations)
        found |= set(layout_of(base, force_port(base)).channels)
    return found


def commission_best(
    recordings: Sequence[Recording],
    settings: CommissionSettings | None = None,
    scheme: Scheme = "auto",
    equations: str = EQUATIONS,
    say: Callable[[str], None] = lambda _: None,
    *,
    stated: Mapping[str, float] | None = None,
) -> RigModel:
    """The model of a rig for the scheme that describes it, or for the requested scheme.

    Args:
        recordings: of all roles.
        settings: of the transfer function's scheme.
        scheme: which one; `auto` chooses.
        equations: name of a shipped model, or its file.
        say: called with one line at each step.
        stated: parameters of the equations that are known, in SI.

    Raises:
        ModelError: recordings are missing or inconsistent, or no scheme describes the healthy rig.
    """
    if scheme == "transfer":
        return commission(recordings, settings)
    transfer, why = (None, "equations were requested")
    if scheme == "auto":
        say("fitting a transfer function")
        transfer, why = _transfer(recordings, settings)
        say(f"{why}; fitting the equations of {equations}")
    try:
        found = commission_equations(recordings, equations, say, stated)
    except ModelError as error:
        if transfer is None:
            raise ModelError(f"{why}; {error}" if scheme == "auto" else str(error)) from error
        return _with_reason(transfer, f"{why}; {error}")
    assert found.scheme is not None
    variants = found.plant.variants if isinstance(found.plant, EquationsPlant) else ()
    used = f"{equations} with {', '.join(variants)}" if variants else equations
    left = (
        f"equations of {used}: {found.scheme.held_out:.3g} left of held-out healthy data,"
        f" {100 * found.scheme.share:.1f} % of what is measured at worst, whatever the excitation"
    )
    if found.scheme.described_hz:
        left += f" up to {found.scheme.described_hz:.3g} Hz; faster motion is not judged"
    return _with_reason(found, f"{left}; {why}")


def _with_reason(model: RigModel, why: str) -> RigModel:
    return replace(model, scheme=replace(model.scheme or SchemeSection(why=""), why=why))


def _transfer(
    recordings: Sequence[Recording], settings: CommissionSettings | None
) -> tuple[RigModel | None, str]:
    """The thesis's scheme if it is suitable, and why it is or is not."""
    try:
        model = commission(recordings, settings)
    except ModelError as error:
        return None, f"transfer function: {error}"
    shares = []
    for one in recordings:
        if one.role == "healthy":
            armed, raised = _watched(one, model)
            if raised:
                return (
                    None,
                    f"transfer function: it raises {raised} on the healthy recording {one.name}",
                )
            shares.append(armed)
    if min(shares) < LEAST_ARMED:
        armed = 100 * min(shares)
        return None, f"transfer function: it is armed over {armed:.0f} % of a healthy recording"
    return model, f"transfer function: armed over {100 * min(shares):.0f} % of healthy recordings"


def _watched(one: Recording, model: RigModel) -> tuple[float, str]:
    """Share of a recording over which the scheme is armed, and the fault detected, if any."""
    n = len(one.channel(model.channels[0]))
    at = np.arange(n, dtype=np.int64)
    times = np.asarray(at * (1e9 / one.sample_rate), np.int64)
    columns = tuple(Column(name, "", one.channel(name)) for name in model.channels)
    result = Monitor(model).update(SampleBlock("", 1, 0, times // 1000, times, columns))
    assert result is not None
    armed = result.estimates.column("armed").values > 0.0
    seen = [c.name for c in result.conditions if c.name in FAULTS and _holds(c.active)]
    return float(np.mean(armed)), seen[0] if seen else ""


def _holds(active: np.ndarray) -> bool:
    """Whether a condition lasts for two samples."""
    return bool(np.any((active[1:] > 0) & (active[:-1] > 0)))
