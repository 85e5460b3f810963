"""Confidence intervals of parameters that remain valid for autocorrelated residuals.

A wrong model leaves residuals that are autocorrelated over many samples, and the textbook
covariance, which assumes independent residuals, is too small. Here whole blocks are left out, one
at a time (delete-a-block jackknife: B. Efron, C. Stein, Annals of Statistics 9, 1981; as
cluster-robust covariance "CR3": R. M. Bell, D. F. McCaffrey, Survey Methodology 28, 2002):

    θ − θ₋b = (N − Nb)⁻¹·gb,   cov θ = (B − 1)/B · Σ_b (θ − θ₋b)(θ − θ₋b)ᵀ

with N = JᵀJ, Nb = JbᵀJb and gb = Jbᵀrb of B blocks. A parameter that shows in a few blocks only, as
a stop that is seldom reached, has a variance of few degrees of freedom. Student's t therefore has
those of each variance, after Satterthwaite for independent residuals (Bell and McCaffrey, 2002).
Without the only block in which a parameter shows there is no θ₋b: see `lone_blocks.py`.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from rigwatch.physics.engine.equations import System
from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.score import autocorrelation, correlation_time
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.units import unit_of
from rigwatch.workbench.fit.fitted import blocks
from rigwatch.workbench.fit.lone_blocks import TOLD, lost, with_lone_blocks_divided

CONFIDENCE = 0.95
ENOUGH = 12
"""Number of windows above which each is a block of its own."""
BLOCK_LENGTH, FEWEST = 2.0, 8
"""Length of a block over the correlation time, and number of blocks that must be left."""
FARTHEST = 1e70
"""Largest change of a parameter; one that hardly moves the model has no larger, and the squares of
variances stay finite."""
PHASES = 20
"""Number of parts of one repetition, each a block."""
OF_OPENING = "from the first samples of a held-out recording"
NO_INFLUENCE = "has no influence on this recording"
"""Remark on a parameter with which no output changes."""
TIED = 0.98
"""Correlation above which two parameters count as tied."""


@dataclass(frozen=True)
class Value:
    """A parameter with its interval.

    Attributes:
        value: in `unit`.
        unit: its unit.
        interval: 95 %, None if the parameter was not fitted.
        note: remark on a poorly determined value; empty otherwise.
    """

    value: float
    unit: str
    interval: tuple[float, float] | None
    note: str = ""

    def shown_in(self, text: str) -> "Value":
        """The value converted from SI to the unit `text`."""
        unit = unit_of(text)
        ends = self.interval and (unit.from_si(self.interval[0]), unit.from_si(self.interval[1]))
        return replace(self, value=unit.from_si(self.value), unit=text, interval=ends)


def shown(value: Value) -> str:
    """A value with its unit, if it has one, and its interval, as text."""
    told = f"{value.value:.3g} {value.unit}".removesuffix(" 1")
    if value.interval is None:
        return told
    low, high = value.interval
    return f"{told} ({low:.3g} … {high:.3g})"


def as_written(found: Mapping[str, Value], system: System) -> dict[str, Value]:
    """Values of a system's parameters, converted from SI to the units of their files."""
    units = {name: system.parameters[name].shown for name in found}
    return {n: value.shown_in(units[n]) if units[n] else value for n, value in found.items()}


def covariance(fitted: Fit, repeat: int = 0) -> tuple[FloatArray, FloatArray]:
    """Covariance of the free parameters, (m, m), and degrees of freedom of each variance, (m,).

    Args:
        fitted: the fit.
        repeat: samples after which the excitation repeats or inverts, 0 if it does not.
    """
    m = fitted.jacobian.shape[-1]
    whole, error = fitted.jacobian.reshape(-1, m), fitted.error.reshape(-1)
    # Columns are scaled to equal norm, so that small ones are not truncated as rank-deficient.
    size = np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
    whole = whole / size
    sample = np.arange(error.size) // len(fitted.scale)
    order = sample % repeat if repeat else sample
    parts = with_lone_blocks_divided(whole, error, block_numbers(fitted, repeat), order)
    own = np.array([whole[rows].T @ whole[rows] for rows in parts])
    normal = whole.T @ whole
    rest = np.linalg.pinv(normal - own, rcond=TOLD)
    slopes = np.array([whole[rows].T @ error[rows] for rows in parts])
    moved = np.clip(np.einsum("bij,bj->bi", rest, slopes) / size, -FARTHEST, FARTHEST)
    spread = moved.T @ moved * ((len(parts) - 1) / len(parts))
    lone = np.any(lost(normal - own) & ~lost(normal), axis=0)
    spread[lone, lone] = FARTHEST**2
    return np.asarray(spread), _degrees_of_freedom(normal, own, rest)


def _degrees_of_freedom(normal: FloatArray, own: FloatArray, rest: FloatArray) -> FloatArray:
    """Degrees of freedom of each variance, shape (m,).

    The change of a parameter when block b is left out is uᵀ·gb. For independent residuals these
    changes have the covariance Ω, and their squares as many degrees of freedom as (tr Ω)²/tr Ω².

    Args:
        normal: N, shape (m, m).
        own: Nb of each block, shape (blocks, m, m).
        rest: (N − Nb)⁻¹, shape (blocks, m, m).
    """
    inverse = np.linalg.pinv(normal, rcond=TOLD)
    found = np.ones(len(normal))
    for index in range(len(normal)):
        u = rest[:, :, index]
        turned = np.einsum("bi,bij->bj", u, own)
        omega = np.diag(np.sum(turned * u, axis=1)) - turned @ inverse @ turned.T
        size = float(np.sum(omega**2))
        if size > 0:
            found[index] = max(float(np.trace(omega)) ** 2 / size, 1.0)
    return found


def block_numbers(fitted: Fit, repeat: int = 0) -> IntArray:
    """Number of the block that each row of the flattened error belongs to, shape (rows,).

    Windows are blocks if there are enough, as parts of a window share its initial state; few are
    divided, and those that are shorter than the error is correlated are joined. If the excitation
    repeats, what a wrong model leaves repeats with it, and all samples of the same part of a
    repetition are one block.

    Args:
        fitted: the fit.
        repeat: samples after which the excitation repeats or inverts, 0 if it does not.
    """
    count, rows = fitted.error.shape
    samples = fitted.error.size // len(fitted.scale)
    if 0 < repeat < samples:
        phase = np.arange(samples) % repeat
        return np.repeat(phase * min(PHASES, repeat) // repeat, len(fitted.scale))
    if count >= ENOUGH:
        lengths = [rows] * count
    else:
        lengths = [len(block) for block in blocks(fitted.error)]
    together = _blocks_together(fitted, len(lengths))
    return np.repeat(np.arange(len(lengths)) // together, lengths)


def _blocks_together(fitted: Fit, count: int) -> int:
    """How many of `count` blocks in a row are as long as twice what a parameter remembers.

    The jackknife needs blocks that are nearly independent of each other. A parameter's share of
    each sample, ∂error/∂θ·error, is correlated as long as both are.
    """
    windows, outputs = len(fitted.error), len(fitted.scale)
    slopes = fitted.jacobian.reshape(windows, -1, outputs, fitted.jacobian.shape[-1])
    error = fitted.error.reshape(windows, -1, outputs, 1)
    shares = np.sum(slopes * error, axis=2).reshape(1, -1, slopes.shape[3])
    samples = shares.shape[1]
    correlation = autocorrelation(shares, max(samples // FEWEST, 1))
    longest = max((correlation_time(each) for each in correlation.T), default=1.0)
    needed = BLOCK_LENGTH * longest * count / samples
    return int(np.clip(np.ceil(needed), 1, max(count // FEWEST, 1)))


def values(fitted: Fit, added_variances: Mapping[str, float] | None = None) -> dict[str, Value]:
    """Every parameter of the model with its interval, in SI.

    Args:
        fitted: the fit.
        added_variances: additional variances that the recording does not show, by name.
    """
    system = fitted.compiled.system
    spread: dict[str, float] = {}
    if system.free:
        more = np.array([(added_variances or {}).get(name, 0.0) for name in system.free])
        width = _half_widths(fitted, more)
        spread = dict(zip(system.free, width.tolist(), strict=True))
    notes = identifiability(fitted)
    found = {}
    for name, value in fitted.values().items():
        interval = (value - spread[name], value + spread[name]) if name in spread else None
        parameter = system.parameters[name]
        otherwise = OF_OPENING if parameter.is_of_opening else ""
        found[name] = Value(value, parameter.unit, interval, notes.get(name, otherwise))
    return found


def _half_widths(fitted: Fit, more: FloatArray) -> FloatArray:
    """Half widths of the intervals, shape (m,).

    Args:
        fitted: the fit.
        more: additional variances, shape (m,); as uncertain as blocks without a structure are.
    """
    matrix, degrees = covariance(fitted)
    own = np.maximum(np.diag(matrix), 1e-100)
    blocks_left = max(int(block_numbers(fitted).max()) + 1 - len(own), 1)
    # Degrees of freedom of a sum (B. L. Welch, F. E. Satterthwaite; GUM, G.4).
    together = (own + more) ** 2 / (own**2 / degrees + more**2 / blocks_left)
    return np.asarray(student.ppf(0.5 + CONFIDENCE / 2, together) * np.sqrt(own + more))


def interval_with_held(fitted: Fit, name: str, held: Collection[str]) -> tuple[float, float] | None:
    """Interval of one parameter where some others stay at their values; None if it is not fitted.

    Args:
        fitted: the fit.
        name: the parameter.
        held: those that stay.
    """
    free = fitted.compiled.system.free
    if name not in free:
        return None
    kept = [index for index, other in enumerate(free) if other not in held]
    alone = replace(fitted, jacobian=fitted.jacobian[..., kept])
    width = float(_half_widths(alone, np.zeros(len(kept)))[kept.index(free.index(name))])
    value = fitted.values()[name]
    return value - width, value + width


def identifiability(fitted: Fit) -> dict[str, str]:
    """Remarks on parameters that this recording does not determine, by name."""
    names, m = fitted.compiled.system.free, fitted.jacobian.shape[-1]
    if m == 0:
        return {}
    jacobian = fitted.jacobian.reshape(-1, m)
    sizes = np.linalg.norm(jacobian, axis=0)
    # What a change by its own size does, as parameters have units of their own.
    values, declared = fitted.values(), fitted.compiled.system.parameters
    own = np.array([max(abs(values[n]), abs(declared[n].value)) or 1.0 for n in names])
    notes = {
        name: NO_INFLUENCE
        for name, size in zip(names, own * sizes, strict=True)
        if size < 1e-12 * max((own * sizes).max(initial=0.0), 1e-300)
    }
    seen = [i for i, name in enumerate(names) if name not in notes]
    return notes | _ties(jacobian[:, seen] / sizes[seen], [names[i] for i in seen])


def _ties(unit: FloatArray, names: Sequence[str]) -> dict[str, str]:
    """Remarks on parameters of which others do the same.

    Args:
        unit: sensitivities of the error, scaled to length 1, shape (samples, parameters).
        names: of the parameters.
    """
    notes = {}
    together = np.linalg.pinv(unit.T @ unit, rcond=1e-14)
    root = np.sqrt(np.maximum(np.diag(together), 1e-300))
    correlation = np.minimum(np.abs(together / np.outer(root, root)), 1.0)
    for i, name in enumerate(names):
        others = np.delete(correlation[i], i)
        if others.size and others.max() > TIED:
            partner = [n for n in names if n != name][int(np.argmax(others))]
            notes[name] = f"tied to {partner} (correlation {others.max():.3f})"
    return notes
