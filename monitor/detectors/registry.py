"""Detectors in addition to the friction scheme: one row each, tested by all generic tests.

A detector needs the model file's transfer function from input to output and a table of figures from
`calibrate` on a healthy recording. `monitor.detectors` in the configuration selects the detectors.
Heavy imports wait until a detector is used.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigwatch.wire.errors import ModelError

if TYPE_CHECKING:
    from monitor.detectors.detector import Channels, Detector
    from rigwatch.physics.transfer import TransferFunction
    from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class DetectorKind:
    """One row.

    Attributes:
        name: name in the configuration.
        condition: reported condition, with an alarm of the same name.
        summary: description for people.
        calibrate: (function, healthy recordings, sample rate [Hz]) → figures; a recording has shape
            (n, 3): input, output, acceleration, or (n, 2) without the last.
        make: (function, figures, channels, sample rate [Hz]) → detector.
    """

    name: str
    condition: str
    summary: str
    calibrate: "Callable[[TransferFunction, Sequence[FloatArray], float], dict[str, float]]"
    make: "Callable[[TransferFunction, Mapping[str, float], Channels, float], Detector]"


def _calibrate_parity(*, moving_average: bool) -> "Callable[..., dict[str, float]]":
    def calibrate(
        function: "TransferFunction", healthy: "Sequence[FloatArray]", sample_rate: float
    ) -> dict[str, float]:
        from monitor.detectors.calibration import calibrate_parity

        return calibrate_parity(function, healthy, sample_rate, moving_average=moving_average)

    return calibrate


def _make_parity(*, moving_average: bool) -> "Callable[..., Detector]":
    def make(
        function: "TransferFunction",
        figures: Mapping[str, float],
        channels: "Channels",
        sample_rate: float,
    ) -> "Detector":
        from monitor.detectors.calibration import make_parity

        return make_parity(function, figures, channels, sample_rate, moving_average=moving_average)

    return make


def _calibrate_unknown_input(
    function: "TransferFunction", healthy: "Sequence[FloatArray]", sample_rate: float
) -> dict[str, float]:
    from monitor.detectors.calibration import calibrate_unknown_input

    return calibrate_unknown_input(function, healthy, sample_rate)


def _make_unknown_input(
    function: "TransferFunction",
    figures: Mapping[str, float],
    channels: "Channels",
    sample_rate: float,
) -> "Detector":
    from monitor.detectors.calibration import make_unknown_input

    return make_unknown_input(function, figures, channels, sample_rate)


DETECTORS: tuple[DetectorKind, ...] = (
    DetectorKind(
        "parity-arma",
        "parity_arma",
        "output minus model, judged by an adaptive threshold (Höfling and Deibert)",
        _calibrate_parity(moving_average=False),
        _make_parity(moving_average=False),
    ),
    DetectorKind(
        "parity-ma",
        "parity_ma",
        "remainder of the model's difference equation, judged by an adaptive threshold",
        _calibrate_parity(moving_average=True),
        _make_parity(moving_average=True),
    ),
    DetectorKind(
        "unknown-input-kalman",
        "unknown_input",
        "innovations of a Kalman filter tested, position bias estimated (Nowakowski et al.)",
        _calibrate_unknown_input,
        _make_unknown_input,
    ),
)


def detector_kind(name: str) -> DetectorKind:
    """The row called `name`.

    Raises:
        ModelError: there is none.
    """
    for kind in DETECTORS:
        if kind.name == name:
            return kind
    known = ", ".join(kind.name for kind in DETECTORS)
    raise ModelError(f"detector: found {name!r}, expected one of {known}")
