"""Where a model fails: its residual by time, motion, direction, amplitude and frequency.

Each view divides the residual into regions. A region is significant if its mean squared residual
exceeds the average by more than chance, tested over the blocks that it spans. Regions list their
sample numbers for inspection.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.stats import t as student

from rigwatch.physics.engine.fit import Recording, initial_states
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.workbench.compare.location.recording_time import recording_name, recording_time
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.data import find_period
from rigwatch.workbench.study import told_unit

PIECES = {"time": 12, "grid": 6, "amplitude": 5, "frequency": 12}
LEVEL = 0.01


@dataclass(frozen=True, eq=False)
class Region:
    """A part of a recording.

    Attributes:
        view: kind of division: time, motion, direction, amplitude, input, frequency, lines.
        name: the part, in words.
        channel: output of the residual.
        rms, mean: of the residual there.
        share: of the residual's energy above the noise floor, 0 to 1.
        p_value: of a mean squared residual this far above the average by chance.
        samples: sample numbers, counted through all training recordings; empty for frequencies.
        told_in: unit in which texts tell rms and mean, which are in SI.
    """

    view: str
    name: str
    channel: str
    rms: float
    mean: float
    share: float
    p_value: float
    samples: IntArray
    told_in: str = ""


def locate(bench: Bench) -> list[Region]:
    """All regions of all views, in each view those with the most energy first."""
    found: list[Region] = []
    for index, (channel, output) in enumerate(bench.study.model.outputs.items()):
        residual = bench.base.train.residuals[..., index].ravel()
        floor = float(bench.floor.rms[index])
        regions = _channel(bench, channel, residual, floor)
        found += [replace(region, told_in=told_unit(output)) for region in regions]
    return sorted(found, key=lambda region: (region.channel, region.view, -region.share))


def _channel(bench: Bench, channel: str, residual: FloatArray, floor: float) -> list[Region]:
    recording = bench.data.train
    rows = sample_numbers(recording, len(residual))
    moved = motion(bench, rows)
    found = _cut(channel, residual, floor, rows, "time", _by_time(bench, rows))
    if moved is not None:
        x, v = moved
        views = {
            "motion": _by_motion(x, v),
            "direction": _by_direction(v),
            "amplitude": _by_amplitude(x),
        }
        for view, labels in views.items():
            found += _cut(channel, residual, floor, rows, view, labels)
    for name, signal in _driven(bench, rows).items():
        found += _cut(channel, residual, floor, rows, "input", _by_size(signal, f"|{name}|"))
    factor = recording.thinning.factor if recording.thinning else 1
    found += _spectrum(channel, residual, floor, recording.dt * factor)
    period = find_period(recording)
    if period and factor == 1 and len(residual) >= 2 * period:
        found += _lines(channel, residual, period)
    return found


def sample_numbers(recording: Recording, count: int) -> IntArray:
    """Sample number in the recording of each residual."""
    if recording.thinning is None:
        return np.arange(count)
    every = np.arange(len(recording))[None, :, None].astype(np.float64)
    thin = recording.thinning
    ends = np.cumsum(thin.parts)
    parts = [
        part[0, :: thin.factor, 0][thin.edge : -thin.edge or None]
        for part in np.split(every, ends[:-1], axis=1)
    ]
    return np.concatenate(parts).astype(np.int64)[:count]


def motion(bench: Bench, rows: IntArray) -> tuple[FloatArray, FloatArray] | None:
    """Position and velocity at a force port, as measured."""
    recording, model = bench.data.train, bench.study.model
    names = list(model.inputs)
    for x, v in (("position", "velocity"), ("x", "v")):
        if x in names and v in names:
            columns = recording.inputs[rows]
            return columns[:, names.index(x)], columns[:, names.index(v)]
    states = initial_states(bench.base.compiled.system, recording)[rows]
    known = list(model.states)
    if "x" in known and "v" in known:
        return states[:, known.index("x")], states[:, known.index("v")]
    return None


def _by_time(bench: Bench, rows: IntArray) -> list[str]:
    """The piece of its recording that each sample belongs to; no piece is of two recordings."""
    numbers, times = recording_time(bench, rows)
    labels = list[str]()
    for at in np.unique(numbers).tolist():
        own = times[numbers == at]
        pieces = max(round(PIECES["time"] * len(own) / len(rows)), 1)
        edges = np.linspace(0, len(own), pieces + 1).astype(int)
        name = f"{recording_name(bench, at)}, " if len(bench.data.train.slices) > 1 else ""
        # Of a part that lies hours behind the beginning, each piece has another name.
        digits = max(4, 2 + int(np.log10(max(own[-1] / (np.ptp(own) or 1.0), 1.0) * pieces)))
        for a, b in pairwise(edges):
            label = f"{name}{own[a]:.{digits}g} to {own[min(b, len(own) - 1)]:.{digits}g} s"
            labels += [label] * (b - a)
    return labels


def _steps(signal: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    edges = np.linspace(np.nanmin(signal), np.nanmax(signal), count + 1)
    return np.clip(np.digitize(signal, edges[1:-1]), 0, count - 1), edges


def _by_motion(x: FloatArray, v: FloatArray) -> list[str]:
    count = PIECES["grid"]
    (i, across), (j, along) = _steps(x, count), _steps(v, count)
    return [
        f"x {across[a]:.3g} to {across[a + 1]:.3g}, v {along[b]:.3g} to {along[b + 1]:.3g}"
        for a, b in zip(i, j, strict=True)
    ]


def _by_direction(v: FloatArray) -> list[str]:
    slow = 0.05 * np.nanmax(np.abs(v))
    return ["near standstill" if abs(s) < slow else "forward" if s > 0 else "backward" for s in v]


def _by_amplitude(x: FloatArray) -> list[str]:
    return _by_size(x - np.nanmean(x), "|x - mean|")


def _by_size(signal: FloatArray, name: str) -> list[str]:
    i, edges = _steps(np.abs(signal), PIECES["amplitude"])
    return [f"{name} {edges[a]:.3g} to {edges[a + 1]:.3g}" for a in i]


def _driven(bench: Bench, rows: IntArray) -> dict[str, FloatArray]:
    """The measured inputs that drive the model: those at an actuator port."""
    model, columns = bench.study.model, bench.data.train.inputs[rows]
    driven = {port.signal for port in model.ports.values() if port.kind == "actuator"}
    return {name: columns[:, i] for i, name in enumerate(model.inputs) if name in driven}


def _cut(  # noqa: PLR0917 -- one residual and how it is cut
    channel: str, residual: FloatArray, floor: float, rows: IntArray, view: str, labels: list[str]
) -> list[Region]:
    names = np.array(labels)
    good = np.isfinite(residual)
    excess = max(float(np.sum(residual[good] ** 2 - floor**2)), 1e-300)
    average = float(np.mean(residual[good] ** 2))
    found = []
    for name in dict.fromkeys(labels):
        inside = good & (names == name)
        if inside.sum() < 8:
            continue
        part = residual[inside]
        share = float(np.clip(np.sum(part**2 - floor**2) / excess, 0, 1))
        found.append(
            Region(
                view, name, channel, float(np.sqrt(np.mean(part**2))), float(part.mean()), share,
                _p_value(part**2, average), rows[inside],
            )
        )  # fmt: skip
    return found


def _p_value(squares: FloatArray, average: float) -> float:
    means = np.array(
        [piece.mean() for piece in np.array_split(squares, min(10, len(squares) // 4))]
    )
    if len(means) < 3 or not means.std():
        return 1.0
    statistic = (means.mean() - average) / (means.std(ddof=1) / np.sqrt(len(means)))
    return float(student.sf(statistic, len(means) - 1))


def _spectrum(channel: str, residual: FloatArray, floor: float, dt: float) -> list[Region]:
    clean = np.nan_to_num(residual)
    energy = np.abs(np.fft.rfft(clean)) ** 2 * 2 / len(clean) ** 2
    rate = np.fft.rfftfreq(len(clean), dt)
    edges = np.geomspace(max(rate[1], 0.1 * rate[-1] / 50), rate[-1], PIECES["frequency"] + 1)
    white = floor**2 / len(energy)
    total = max(float(np.sum(energy - white)), 1e-300)
    found = []
    for low, high in pairwise(edges):
        inside = (rate > low) & (rate <= high)
        if inside.any():
            size = float(np.sum(energy[inside]))
            share = float(np.clip((size - white * inside.sum()) / total, 0, 1))
            found.append(
                Region(
                    "frequency", f"{low:.3g} to {high:.3g} Hz", channel, float(np.sqrt(size)),
                    0.0, share, 1.0, np.zeros(0, np.int64),
                )
            )  # fmt: skip
    return found


def _lines(channel: str, residual: FloatArray, period: int) -> list[Region]:
    """Energy at even and odd harmonics of the excitation: even or odd nonlinearities."""
    periods = np.nan_to_num(residual)[: len(residual) // period * period].reshape(-1, period)
    energy = np.abs(np.fft.rfft(periods.mean(axis=0))) ** 2 * 2 / period**2
    # The mean is not a harmonic: an offset would mask the others.
    total = max(float(energy[1:].sum()), 1e-300)
    return [
        Region(
            "lines", name, channel, float(np.sqrt(energy[first::2].sum())), 0.0,
            float(energy[first::2].sum() / total), 1.0, np.zeros(0, np.int64),
        )
        for name, first in (("even multiples", 2), ("odd multiples", 1))
    ]  # fmt: skip
