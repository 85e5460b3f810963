"""Sections of the model file for the observer scheme."""

from typing import Annotated

from msgspec import Meta

from rigwatch.wire.typed_files import Section

Floats = tuple[float, ...]


class EquationsPlant(Section, frozen=True, kw_only=True, tag="equations", tag_field="kind"):
    """[plant] kind = "equations": a model of equations, driven along the measured motion."""

    model: Annotated[str, Meta(min_length=1, description="name of a shipped model, or its file")]
    variants: Annotated[
        tuple[str, ...], Meta(description="variants of it that the healthy rig asks for")
    ] = ()
    names: Annotated[tuple[str, ...], Meta(description="parameters of the model")]
    values: Annotated[Floats, Meta(description="their fitted values, in the model's units")]
    port: Annotated[str, Meta(description="force port at which friction enters")]
    coulomb: Annotated[float, Meta(description="dry friction of the healthy rig [N]")] = 0.0
    turn: Annotated[
        float, Meta(gt=0, description="speed over which the sign of the motion changes [m/s]")
    ] = 1e-3
    half_width: Annotated[
        int, Meta(ge=2, le=32, description="lag of the smoothed motion [samples]")
    ] = 4
    late: Annotated[
        float,
        Meta(description="lateness of the motion behind the predicted output's sensor [s]"),
    ] = 0.0
    corner: Annotated[
        float, Meta(gt=0, description="corner of the high-pass of residual and regressors [Hz]")
    ] = 2.0


class RemainderSection(Section, frozen=True, kw_only=True):
    """The equations' residual on a healthy rig, as a second-degree polynomial in its states."""

    centre: Annotated[Floats, Meta(description="mean of each signal")]
    scale: Annotated[Floats, Meta(description="standard deviation of each signal")]
    weights: Annotated[Floats, Meta(description="of each signal, then of each product of two")]
    information: Annotated[
        Floats,
        Meta(
            description="upper triangle of R, row by row: RᵀR is the inverse of the covariance of "
            "the weights that count, in that of the noise; empty if that is not known"
        ),
    ] = ()


class RangeSection(Section, frozen=True, kw_only=True):
    """The range of motion to which the model was fitted."""

    names: Annotated[tuple[str, ...], Meta(description="inputs, motion, and predicted output")]
    low: Annotated[Floats, Meta(description="least value of each")]
    high: Annotated[Floats, Meta(description="largest value of each")]
    narrow: Annotated[
        float,
        Meta(
            ge=0,
            le=1,
            description="least narrowness of its spectrum: 1 for one frequency, near 0 for "
            "broadband noise",
        ),
    ] = 0.0
    sizes: Annotated[
        Floats, Meta(description="sizes of the motion, rms of the rate of its speed, ascending")
    ] = ()
    paces: Annotated[
        Floats,
        Meta(description="largest mean frequency of a motion of at least each size [Hz]"),
    ] = ()
    drive_paces: Annotated[
        Floats, Meta(description="pace of the drive, of each kind of drive and motion")
    ] = ()
    motion_paces: Annotated[Floats, Meta(description="mean frequency of its motion [Hz]")] = ()
    channels: Annotated[
        tuple[str, ...], Meta(description="channels that measure a state, which cannot jump")
    ] = ()
    bends: Annotated[
        Floats,
        Meta(
            description="largest difference of neighbouring samples of each: of second order where "
            "its rate is a state as well, else of first"
        ),
    ] = ()


BANDS = 7
"""Bands in which the energy of a drive is kept."""


class HealthyLimits(Section, frozen=True, kw_only=True):
    """Size and extremes of the healthy residual."""

    noise: Annotated[float, Meta(gt=0, description="residual at standstill, rms")]
    growth: Annotated[
        Floats,
        Meta(
            description="of the residual's variance: with the predicted output's mean square, with "
            "each motion's, scaled as for the remainder, and with each motion's fourth power"
        ),
    ]
    short: Annotated[float, Meta(gt=0, description="largest energy of a short window")]
    medium: Annotated[float, Meta(gt=0, description="largest energy of a medium window")]
    friction: Annotated[
        float, Meta(gt=0, description="largest Coulomb estimate in standard deviations")
    ]
    sensor_noise: Annotated[float, Meta(gt=0, description="sensors' disagreement at rest, rms")]
    sensor_growth: Annotated[float, Meta(ge=0, description="of it with the measured output")]
    sensor: Annotated[float, Meta(gt=0, description="largest energy of their disagreement")]
    speed_noise: Annotated[
        float, Meta(gt=0, description="speed that cannot be distinguished from rest")
    ]
    unseen: Annotated[
        float,
        Meta(ge=0, description="largest residual of a recording relative to that of all others"),
    ] = 0.0
    steady_paces: Annotated[
        Floats, Meta(description="mean frequency of each steady healthy motion [Hz]")
    ] = ()
    steady_sizes: Annotated[Floats, Meta(description="size of each, as in the range")] = ()
    steady_narrow: Annotated[
        Floats, Meta(description="narrowness of each; 0 of one that drifts, known by its drive")
    ] = ()
    steady_drives: Annotated[
        Floats, Meta(description="pace of the drive of each: 2 sin of twice its phase a sample")
    ] = ()
    steady_drive_energies: Annotated[
        Floats, Meta(description="energies of the bands of each steady healthy drive, in turn")
    ] = ()
    steady_motion_bands: Annotated[
        Floats,
        Meta(
            description="energies of the bands of the drive of each steady healthy motion, in turn;"
            " zeros if it is not a steady one"
        ),
    ] = ()
    steady_energies: Annotated[
        Floats, Meta(description="largest energy over a second of each")
    ] = ()
    steady_shorts: Annotated[
        Floats, Meta(description="largest energy of a short window of each")
    ] = ()
    steady_mediums: Annotated[
        Floats, Meta(description="largest energy of a medium window of each")
    ] = ()
    steady_frictions: Annotated[
        Floats, Meta(description="largest Coulomb estimate of each in standard deviations")
    ] = ()
    steady_onsets: Annotated[
        Floats,
        Meta(description="largest evidence of the onset of dry friction of each, in the same"),
    ] = ()
    steady_skews: Annotated[
        Floats,
        Meta(
            description="skewness of the speed of each, of the rate of its speed, and what both "
            "vary by, in turn"
        ),
    ] = ()


class SchemeSection(Section, frozen=True, kw_only=True):
    """[scheme] — why the file's plant was chosen, and its residual on healthy recordings."""

    why: Annotated[str, Meta(description="why this scheme was chosen, with figures")]
    held_out: Annotated[
        float, Meta(ge=0, description="residual on held-out healthy data, rms, high-passed")
    ] = 0.0
    share: Annotated[float, Meta(ge=0, description="share of the measured output")] = 0.0
    described_hz: Annotated[
        float,
        Meta(ge=0, description="mean frequency above which motion is not described; 0: none [Hz]"),
    ] = 0.0
