"""A plant that is a pure mass: M·q̈ = force + offset - friction, with measured force and position.

The same pipeline monitors it with this in place of the fourth-order model:

    modelled   am = (F̃ + offset)/M,   measured  a = w̃''∗q
    regressors g1 = -sgn(v)/M,        g2 = -v/M         so that θ is friction itself [N], [N/(m/s)]

Position is differentiated by one smooth kernel w (a Hann window to the fourth) and its
derivatives, and the force is smoothed by the same w, so that the equation holds exactly for the
smoothed signals. All signals are delayed by half the kernel.

The healthy plant has friction, so its estimates have fixed limits from commissioning in place of a
healthy average.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.model import (
    BandSection,
    DecisionSection,
    FrictionSection,
    InertiaPlant,
    NoiseSection,
    RecordingSection,
    RigModel,
    WindowSection,
)
from monitor.signals.admission import DEAD, NEW_BOOT, RESTART, Codes
from monitor.signals.recordings import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel

CHANNELS = ("force", "position")
_LEAST_SPEED = 0.02
"""Share of the top speed below which the sign of the velocity is uncertain."""


def kernels(half_width: int, sample_rate: float) -> FloatArray:
    """w and its first and second derivatives in time, newest sample first, shape (3, 2·half_width
    + 1).
    """
    place = np.arange(-half_width, half_width + 1) / (half_width + 1.0)
    angle = 0.5 * np.pi * place
    w = np.cos(angle) ** 4
    total = w.sum()
    step = 0.5 * np.pi / (half_width + 1.0) * sample_rate
    first = -4.0 * np.cos(angle) ** 3 * np.sin(angle)
    second = 12.0 * np.cos(angle) ** 2 * np.sin(angle) ** 2 - 4.0 * np.cos(angle) ** 4
    out = np.array([w, -first * step, second * step**2]) / total
    out[1] *= 1.0 / (out[1] @ (-place * (half_width + 1.0) / sample_rate))
    out[2] -= out[2].mean()
    time = place * (half_width + 1.0) / sample_rate
    out[2] *= 2.0 / (out[2] @ time**2)
    return np.asarray(out)


class InertiaResidual:
    """The stage: force and position in, the decision's columns out."""

    def __init__(self, model: RigModel) -> None:
        if not isinstance(model.plant, InertiaPlant):
            raise TypeError("InertiaResidual needs a plant that is an inertia")
        self._kernels = kernels(model.plant.half_width, model.sample_rate)
        self._mass, self._offset = model.plant.mass, model.plant.offset
        self._ring = np.zeros((2, self._kernels.shape[1]))
        self._place = np.zeros(2, np.int64)
        self.reset = np.zeros(0, np.bool_)

    def adopt(self, plant: InertiaPlant) -> None:
        """Continue with another mass and offset; the smoothed signals stay."""
        self._mass, self._offset = plant.mass, plant.offset

    def update(self, signals: FloatArray, code: Codes) -> FloatArray:
        """The next samples, shape (n, 2) of force and position, to the stage's columns, shape (n,
        7).

        The kernel is finite, so nothing lasts and nothing has to be reset.
        """
        out = np.zeros((code.size, 7))
        self.reset = np.zeros(code.size, np.bool_)
        _advance(
            signals, code, self._kernels, self._ring, self._place, self._mass, self._offset, out
        )
        return out


@kernel()
def _advance(  # noqa: PLR0917
    signals: FloatArray,
    code: Codes,
    kernel: FloatArray,
    ring: FloatArray,
    place: Codes,
    mass: float,
    offset: float,
    out: FloatArray,
) -> None:
    length = kernel.shape[1]
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            place[1] = 0
        if code[k] == DEAD:
            continue
        place[0] = (place[0] + 1) % length
        ring[0, place[0]], ring[1, place[0]] = signals[k, 0], signals[k, 1]
        place[1] = min(place[1] + 1, length)
        if place[1] < length:
            continue
        force = position = speed = acceleration = 0.0
        origin = ring[1, place[0]]
        for n in range(length):
            at = (place[0] - n) % length
            moved = ring[1, at] - origin
            force += kernel[0, n] * ring[0, at]
            position += kernel[0, n] * moved
            speed += kernel[1, n] * moved
            acceleration += kernel[2, n] * moved
        sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
        out[k, 0], out[k, 1], out[k, 2] = force, position + origin, acceleration
        out[k, 3] = (force + offset) / mass
        out[k, 4], out[k, 5], out[k, 6] = speed, -sign / mass, -speed / mass


def commission_inertia(
    recordings: Sequence[Recording], window: int | None = None, hop: int = 1, half_width: int = 20
) -> RigModel:
    """Mass, offset and the healthy friction with its limits, from one healthy recording.

    Raises:
        ModelError: there is not exactly one recording, or it does not move enough.
    """
    if len(recordings) != 1 or recordings[0].role != "healthy":
        raise ModelError("commissioning an inertia: expected exactly one healthy recording")
    recording = recordings[0]
    force, speed, acceleration = smoothed(recording, half_width)
    found = _balance(recording.name, force, speed, acceleration)
    c, b = found.coulomb, found.viscous
    spread = 0.5 * c, max(0.5 * abs(b), 0.5 * c / float(np.max(np.abs(speed))))
    return RigModel(
        sample_rate=recording.sample_rate,
        channels=CHANNELS,
        plant=InertiaPlant(mass=found.mass, offset=found.offset, half_width=half_width),
        friction=FrictionSection(b=(1.0,), a=(1.0,), gamma=max(b / c, 0.0)),
        noise=NoiseSection(residual=found.left),
        window=WindowSection(length=window or int(6 * recording.sample_rate), hop=hop),
        decision=DecisionSection(
            settle=2 * half_width + 1, least_velocity=0.02 * float(np.std(speed))
        ),
        band=BandSection(low=(c - spread[0], b - spread[1]), high=(c + spread[0], b + spread[1])),
        recording=(RecordingSection(role="healthy", name=recording.name, sha256=recording.sha256),),
    )


@dataclass(frozen=True, slots=True)
class _Balance:
    """Forces on the mass, fitted where it moves.

    Attributes:
        mass: moving mass [kg].
        coulomb: dry friction [N].
        viscous: viscous friction [N s/m].
        offset: of the force [N].
        left: standard deviation of what remains [m/s^2].
    """

    mass: float
    coulomb: float
    viscous: float
    offset: float
    left: float


def _balance(name: str, force: FloatArray, speed: FloatArray, acceleration: FloatArray) -> _Balance:
    """The balance of the smoothed signals of the recording `name`, each of shape (n,).

    Raises:
        ModelError: it does not move enough, or mass or friction is not above 0.
    """
    moving = np.abs(speed) > _LEAST_SPEED * np.max(np.abs(speed))
    columns = np.column_stack([acceleration, np.sign(speed), speed, -np.ones(speed.size)])[moving]
    if np.linalg.cond(columns / np.linalg.norm(columns, axis=0)) > 1e6:
        raise ModelError(f"{name}: found too little motion to tell mass from friction")
    fitted, *_ = np.linalg.lstsq(columns, force[moving], rcond=None)
    mass, coulomb, viscous, offset = fitted.tolist()
    if not (mass > 0.0 and coulomb > 0.0):
        raise ModelError(
            f"{name}: found mass {mass:g} kg and friction {coulomb:g} N, expected both above 0"
        )
    left = float(np.std((force[moving] - columns @ fitted) / mass))
    return _Balance(mass, coulomb, viscous, offset, left)


def smoothed(recording: Recording, half_width: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Force [N], velocity [m/s] and acceleration [m/s^2] of a recording, all smoothed by the
    kernel, edges left out.
    """
    w, first, second = kernels(half_width, recording.sample_rate)
    force, position = recording.channel("force"), recording.channel("position")
    position = position - position.mean()
    return (
        np.convolve(force, w, "valid"),
        np.convolve(position, first, "valid"),
        np.convolve(position, second, "valid"),
    )
