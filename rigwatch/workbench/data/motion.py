"""A study along its measured motion, for models with states that no channel measures.

With unknown initial pressures, fluxes or temperatures free runs drift. Driven by the measured
motion these states converge within a fraction of a second, and a whole recording is one run without
windows. This form is used if channels measure some but not all of a model's states, at least one
output remains to be predicted, and no parameter is lost on which a free run depends; a study can
request either form (`prediction.py`).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from msgspec import structs
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rigwatch.physics.engine.equations import (
    Model,
    along_measured_motion,
    measured_states,
    unmoved_at_rest,
)
from rigwatch.physics.engine.fit import (
    Recording,
    motion_phases,
    motion_recording,
    motion_widths,
)
from rigwatch.physics.transfer import SensorPhase
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data.prediction import form_along_motion
from rigwatch.workbench.data.signals import Data, MotionSensor
from rigwatch.workbench.study import Study

SETTLING = 1.0
"""Settling time allowed for hidden states [s]; at most a tenth of a part."""
SLOW = 0.05
"""Speed over its rms below which samples do not count: there a smoothed motion does not show
the direction of sliding, nor whether the rig sticks."""
STUCK = 5
"""Samples over which a rig that is not moving moves less than at that speed in one of them."""
BESIDE = 9
"""Samples about a rest that do not count: smoothing spreads the instant in which a rig stops."""
STICKS = 0.05
"""Share of rests from which a rig sticks: its friction then bends the speed where it reverses so
much that smoothing shows the reversal a sample late, and the sample before does not count either.
"""
UNCHECKED = (
    "no healthy recording: the model cannot be checked; record one with nothing wrong and list it"
    " under [[healthy]]"
)
NONE_COUNTS = (
    "found no sample that counts along the measured motion, expected one that moves: those near"
    " standstill do not count, nor those in which hidden states settle"
)
RANGE_RATIO = 1.2
"""Ratio of motion ranges above which a recording is reported to exceed the healthy one."""
LATE = (
    "{channel} is {late:.2g} ms {side} what measures its rate, on the healthy recording: its"
    " motion is shifted by that"
)


def along_motion(study: Study, data: Data) -> tuple[Study, Data]:
    """The study with its model along the measured motion, and its recordings for that.

    Args:
        study: as opened.
        data: its recordings, for the unmodified model.

    Raises:
        ModelError: no channel measures any of the model's states, no output is left to predict, or
            no sample of a recording counts.
    """
    # One width for all recordings: the smoothing is part of the fitted model.
    shown_by = data.healthy or data.train
    widths = motion_widths(study.model, shown_by)
    phases = motion_phases(study.model, data.healthy) if data.healthy is not None else {}
    late = {channel: phase.shift for channel, phase in phases.items() if phase.shift}
    slow = SLOW * _rms(motion_recording(study.model, shown_by, widths=widths).inputs)

    def made(recording: Recording) -> Recording:
        shortest = min(recording.parts or (len(recording),)) * recording.dt
        settling = min(SETTLING, shortest / 10)
        whole = motion_recording(
            study.model, recording, settling=settling, widths=widths, late=late
        )
        return _while_moving(study, _with_rests(study, whole, slow), slow)

    healthy = made(data.healthy) if data.healthy is not None else None
    train, held_out = made(data.train), made(data.held_out)
    for use, recording in (("train", train), ("healthy", healthy)):
        if recording is not None and not np.isfinite(recording.outputs).any(axis=0).all():
            raise ModelError(f"{use}: {NONE_COUNTS}")
    openings = made(data.openings) if data.openings is not None else None
    # A healthy motion without rests does not tell at what level the model's balance rests.
    level_known = healthy is None or _rests(study, healthy) or not _rests(study, train, held_out)
    held = unmoved_at_rest(study.model, level_known=level_known)
    model = with_sensor_chain(along_measured_motion(held), phases)
    longest = max(len(r) for r in (train, held_out, healthy) if r is not None)
    form = form_along_motion(study.model)
    told: tuple[str, ...] = () if healthy is not None else (UNCHECKED,)
    told += tuple(_lateness_remark(channel, late[channel]) for channel in late)
    remarks = (*data.remarks, form, *told, *motion_range_remarks(study, train, held_out, healthy))
    along = Data(
        train, held_out, healthy, longest, remarks, along_motion=True, motion=_sensors(study),
        openings=openings, altered=data.altered,
    )  # fmt: skip
    return replace(study, model=model), along


def with_sensor_chain(model: Model, phases: Mapping[str, SensorPhase]) -> Model:
    """The model with its sensors' parameters as the healthy motion alone determines them.

    Fitted with the others, the corner of an AC-coupled sensor or its lateness may stand in for what
    the model describes poorly, and a force at the load then passes through a wrong sensor.

    Args:
        model: along its measured motion.
        phases: between channels of the motion and the outputs that measure their rates.
    """
    known: dict[str, float] = {}
    for phase in phases.values():
        output = next(iter(model.outputs.values()))
        if output.late and phase.is_late_known:
            known[output.late] = 0.0
        if output.corner and phase.known_corner is not None:
            known[output.corner] = phase.known_corner
    parameters = {
        n: structs.replace(p, value=float(np.clip(known[n], p.low, p.high)), fixed=True, kept=False)
        if n in known
        else p
        for n, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)


def _lateness_remark(channel: str, late: float) -> str:
    side = "behind" if late > 0.0 else "ahead of"
    return LATE.format(channel=channel, late=1e3 * abs(late), side=side)


def _with_rests(study: Study, recording: Recording, slow: FloatArray) -> Recording:
    """The recording with rates of exactly zero where the motion rests, see `unmoved_at_rest`.

    Args:
        study: whose model has states that are measured.
        recording: along the measured motion.
        slow: rate of each input that is hardly one, shape (inputs,).
    """
    measured = list(enumerate(measured_states(study.model), start=len(study.model.inputs)))
    places = {state.channel: column for column, state in measured if state.order == 0}
    inputs = recording.inputs.copy()
    for column, state in measured:
        if state.order == 1 and state.channel in places:
            position, rate = inputs[:, places[state.channel]], inputs[:, column]
            moved = maximum_filter1d(position, STUCK) - minimum_filter1d(position, STUCK)
            still = moved <= slow[column] * recording.dt
            still &= maximum_filter1d(np.abs(rate), STUCK) < slow[column]
            inputs[maximum_filter1d(still, STUCK), column] = 0.0
    return replace(recording, inputs=inputs)


def _rests(study: Study, *recordings: Recording) -> bool:
    """Whether a motion rests in any of the recordings, of `_with_rests`."""
    measured = enumerate(measured_states(study.model), start=len(study.model.inputs))
    rates = [column for column, state in measured if state.order == 1]
    return any(bool(np.any(recording.inputs[:, rates] == 0.0)) for recording in recordings)


def _while_moving(study: Study, recording: Recording, slow: FloatArray) -> Recording:
    """The recording without samples at which a measured rate is slower than `slow`, (inputs,)."""
    measured = enumerate(measured_states(study.model), start=len(study.model.inputs))
    rates = [column for column, state in measured if state.order == 1]
    if not rates or recording.thinning is not None:
        return recording
    speeds = recording.inputs[:, rates]
    still = np.any(np.abs(speeds) < slow[rates], axis=1)
    rests = np.any(speeds == 0.0, axis=1)
    still |= maximum_filter1d(rests, BESIDE)
    if rests.mean() > STICKS:
        still[1:] |= np.any(speeds[1:] * (2.0 * speeds[1:] - speeds[:-1]) < 0.0, axis=1)
    return replace(recording, outputs=np.where(still[:, None], np.nan, recording.outputs))


def _sensors(study: Study) -> tuple[MotionSensor, ...]:
    """Sensors that measure a position whose rate is a speed input."""
    model, columns = study.model, dict[str, dict[int, int]]()
    for column, state in enumerate(measured_states(model), start=len(model.inputs)):
        columns.setdefault(state.channel, {})[state.order] = column
    ports = {
        model.outputs[port.signal].channel or port.signal: name
        for name, port in model.ports.items()
        if port.kind == "sensor"
    }
    return tuple(
        MotionSensor(ports[channel], found[0], found[1])
        for channel, found in columns.items()
        if channel in ports and 0 in found and 1 in found
    )


def _rms(signals: FloatArray) -> FloatArray:
    """Root mean square of each column, shape (columns,)."""
    return np.asarray(np.sqrt(np.mean(signals**2, axis=0)))


def motion_range_remarks(
    study: Study, train: Recording, held_out: Recording, healthy: Recording | None
) -> list[str]:
    """Remarks on motions that exceed the range of the healthy recording."""
    found: list[str] = []
    if healthy is None:
        return found
    first = len(study.model.inputs)
    for column, state in enumerate(measured_states(study.model), start=first):
        for use, recording in (("train", train), ("held_out", held_out)):
            reach = np.ptp(recording.inputs[:, column])
            known = np.ptp(healthy.inputs[:, column])
            if reach > RANGE_RATIO * known:
                unit = study.model.states[state.name].unit
                found.append(
                    f"{use}: {state.name} spans {reach:.3g} {unit}, and the healthy recording"
                    f" shows {known:.3g} {unit}: record a healthy motion as wide"
                )
    return found
