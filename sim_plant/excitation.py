"""Drive voltages: one declaration each, listed in `Excitation`.

An excitation is a section of a scenario file (`shape = "sine"` picks it) that turns sample numbers
into volts. It uses sample numbers, not a running phase, so that a run does not depend on its
division into calls.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, get_args

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section

Source = Callable[[NDArray[np.int64]], NDArray[np.float64]]
"""Sample numbers to volts, same shape."""

Volts = Annotated[float, Meta(ge=0, le=5, description="amplitude (peak) [V]")]
Hertz = Annotated[float, Meta(gt=0, description="frequency [Hz]")]


class Shape(Section, frozen=True, kw_only=True, tag_field="shape"):
    """Base of the excitations."""

    ramp_s: Annotated[float, Meta(ge=0, description="time to full amplitude at the start [s]")] = (
        0.5
    )

    def source(self, rate: float) -> Source:
        """Volts at sample numbers, at `rate` samples a second [Hz], before the ramp."""
        raise NotImplementedError


class Periodic(Shape, frozen=True, kw_only=True):
    """Base of the periodic ones."""

    amplitude: Volts
    frequency: Hertz
    phase: Annotated[float, Meta(description="at t = 0 [cycles]")] = 0.0

    def source(self, rate: float) -> Source:
        """Volts at sample numbers."""

        def volts(k: NDArray[np.int64]) -> NDArray[np.float64]:
            cycle = np.asarray(k * self.frequency / rate + self.phase, dtype=np.float64)
            return self.amplitude * self.wave(cycle % 1.0)

        return volts

    def wave(self, cycle: NDArray[np.float64]) -> NDArray[np.float64]:
        """The shape over one cycle, 0 to 1, with peaks of 1."""
        raise NotImplementedError


class Sine(Periodic, frozen=True, kw_only=True, tag="sine"):
    """A sine."""

    def wave(self, cycle: NDArray[np.float64]) -> NDArray[np.float64]:
        """sin(2 pi cycle)."""
        return np.sin(2 * np.pi * cycle)


class Square(Periodic, frozen=True, kw_only=True, tag="square"):
    """A square wave: high for the first half of a cycle."""

    def wave(self, cycle: NDArray[np.float64]) -> NDArray[np.float64]:
        """1, then -1."""
        return np.where(cycle < 0.5, 1.0, -1.0)


class Triangle(Periodic, frozen=True, kw_only=True, tag="triangle"):
    """A triangle wave in phase with the sine."""

    def wave(self, cycle: NDArray[np.float64]) -> NDArray[np.float64]:
        """0, 1, 0, -1 at quarters of the cycle."""
        return 1.0 - 4.0 * np.abs((cycle + 0.25) % 1.0 - 0.5)


class Chirp(Shape, frozen=True, kw_only=True, tag="chirp"):
    """A repeated linear sweep of a sine.

    It repeats without a jump if the sweep holds a whole number of cycles, which is
    (start + stop) / 2 times its length.
    """

    amplitude: Volts
    start: Annotated[float, Meta(gt=0, description="first frequency [Hz]")]
    stop: Annotated[float, Meta(gt=0, description="last frequency [Hz]")]
    length_s: Annotated[float, Meta(gt=0, description="length of one sweep [s]")]
    phase: Annotated[float, Meta(description="phase at which a sweep starts [cycles]")] = 0.25

    def source(self, rate: float) -> Source:
        """Volts at sample numbers."""

        def volts(k: NDArray[np.int64]) -> NDArray[np.float64]:
            t = (k / rate) % self.length_s
            cycles = (
                self.phase + self.start * t + 0.5 * (self.stop - self.start) / self.length_s * t**2
            )
            return self.amplitude * np.sin(2 * np.pi * cycles)

        return volts


class Multisine(Shape, frozen=True, kw_only=True, tag="multisine"):
    """A multisine: lines of equal amplitude and random phase, repeated every `period` samples.

    `amplitude` is the largest voltage of a period. Of 32 sets of random phases, the one with the
    lowest peak is taken.
    """

    amplitude: Volts
    start: Annotated[float, Meta(gt=0, description="lowest frequency [Hz]")]
    stop: Annotated[float, Meta(gt=0, description="highest frequency [Hz]")]
    period: Annotated[int, Meta(ge=16, description="samples in a period")] = 4096
    odd_only: Annotated[bool, Meta(description="leave out even lines, to see distortion")] = False
    seed: Annotated[int, Meta(ge=0, description="of the phases")] = 0

    def lines(self, rate: float) -> NDArray[np.int64]:
        """Numbers of the excited lines, in multiples of rate / period."""
        low, high = (f * self.period / rate for f in (self.start, self.stop))
        lines = np.arange(np.ceil(low), np.floor(high) + 1, dtype=np.int64)
        return lines[lines % 2 == 1] if self.odd_only else lines

    def source(self, rate: float) -> Source:
        """Volts at sample numbers."""
        period = self._one_period(self.lines(rate))
        return lambda k: period[k % self.period]

    def _one_period(self, lines: NDArray[np.int64]) -> NDArray[np.float64]:
        random = np.random.default_rng(self.seed)
        spectra = np.zeros((32, self.period // 2 + 1), dtype=np.complex128)
        spectra[:, lines] = np.exp(2j * np.pi * random.random((32, lines.size)))
        waves = np.fft.irfft(spectra, self.period)
        peaks = np.abs(waves).max(axis=1)
        best = int(np.argmin(peaks))
        return np.asarray(self.amplitude * waves[best] / peaks[best])


class Recorded(Shape, frozen=True, kw_only=True, tag="recorded"):
    """Recorded samples: a file with one voltage per line, or a list.

    Zero before t = 0 and, unless looped, after the last sample.
    """

    file: Annotated[str, Meta(description="text file of one number a line")] = ""
    samples: Annotated[tuple[float, ...], Meta(description="in place of a file [V]")] = ()
    gain: Annotated[float, Meta(description="factor on the samples")] = 1.0
    loop: Annotated[bool, Meta(description="start again at the end")] = False

    def source(self, rate: float) -> Source:  # noqa: ARG002
        """Volts at sample numbers."""
        recorded = self.gain * self._read()
        loop = self.loop

        def volts(k: NDArray[np.int64]) -> NDArray[np.float64]:
            inside = (k >= 0) & (loop | (k < recorded.size))
            return np.where(inside, recorded[k % recorded.size], 0.0)

        return volts

    def _read(self) -> NDArray[np.float64]:
        if bool(self.file) == bool(self.samples):
            raise ConfigError(
                "scenario", "excitation", "both or neither of file and samples", "one of them"
            )
        if not self.file:
            return np.array(self.samples)
        try:
            lines = Path(self.file).read_text(encoding="utf-8").split()
            recorded = np.array([float(line) for line in lines])
        except (OSError, ValueError) as error:
            raise ConfigError(self.file, "", str(error), "one number a line") from error
        if recorded.size == 0 or not np.isfinite(recorded).all():
            raise ConfigError(self.file, "", "none, or not finite", "one finite number a line")
        return recorded


class Silence(Shape, frozen=True, kw_only=True, tag="silence"):
    """No drive at all."""

    def source(self, rate: float) -> Source:  # noqa: ARG002
        """Zeros."""
        return lambda k: np.zeros(k.shape)


Excitation = Sine | Square | Triangle | Chirp | Multisine | Recorded | Silence

SHAPES: tuple[type[Shape], ...] = get_args(Excitation)
"""Every excitation, for tests and documentation."""


def drive(excitation: Shape, rate: float, begins: int = 0) -> Source:
    """The excitation with its ramp, which starts at the sample number `begins`."""
    source, length = excitation.source(rate), excitation.ramp_s * rate

    def ramped(k: NDArray[np.int64]) -> NDArray[np.float64]:
        if length == 0 or k.size == 0 or k[0] - begins >= length:
            return source(k)
        return source(k) * np.clip((k - begins) / length, 0.0, 1.0)

    return ramped
