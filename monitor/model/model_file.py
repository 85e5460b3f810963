"""The model file: the results of commissioning in one readable TOML file.

`load_model` reads it, `model_text` prints it. Numbers are printed in full precision, so a file read
back gives the same estimates to the last bit.
"""

import math
from pathlib import Path
from typing import Annotated

from msgspec import Meta, field, structs

from monitor.model.observer_sections import (
    BANDS,
    EquationsPlant,
    HealthyLimits,
    RangeSection,
    RemainderSection,
    SchemeSection,
)
from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import FASTEST, SLOWEST
from rigwatch.wire.typed_files import Section, load, parse
from rigwatch.wire.wiring_names import Wiring

Floats = tuple[float, ...]


class FunctionSection(Section, frozen=True, kw_only=True):
    """B(q⁻¹)/A(q⁻¹), ascending powers of q⁻¹."""

    b: Annotated[Floats, Meta(min_length=1, description="numerator")]
    a: Annotated[Floats, Meta(min_length=1, description="denominator, starts with 1")]

    def function(self) -> TransferFunction:
        """The transfer function."""
        return TransferFunction.of(self.b, self.a)


class TransferPlant(
    FunctionSection, frozen=True, kw_only=True, tag="transfer_function", tag_field="kind"
):
    """[plant] kind = "transfer_function": voltage [V] to position [m], (5.16)."""

    shift: Annotated[
        int, Meta(ge=0, le=8, description="samples by which the second difference is advanced")
    ] = 1


class InertiaPlant(Section, frozen=True, kw_only=True, tag="inertia", tag_field="kind"):
    """[plant] kind = "inertia": M·q̈ = force + offset."""

    mass: Annotated[float, Meta(gt=0, description="moving mass M [kg]")]
    offset: Annotated[float, Meta(description="constant force [N]")] = 0.0
    half_width: Annotated[
        int, Meta(ge=2, description="half length of the differentiating filter [samples]")
    ] = 20


Plant = TransferPlant | InertiaPlant | EquationsPlant


class VelocitySection(Section, frozen=True, kw_only=True):
    """[velocity] — velocity from the accelerometer (docs/theory.md 1.3)."""

    corner: Annotated[float, Meta(gt=0, description="corner of the high-pass [Hz]")] = 0.5
    sensor_corner: Annotated[
        float, Meta(ge=0, description="corner of the accelerometer's own high-pass [Hz]")
    ] = 0.0


class FrictionSection(FunctionSection, frozen=True, kw_only=True):
    """[friction] — friction filter Ge and signature (5.29)."""

    gamma: Annotated[float, Meta(ge=0, description="signature (1, gamma) [s/m]")]
    explained: Annotated[float, Meta(le=1, description="share of the known fault explained")] = 0.0


class WindowSection(Section, frozen=True, kw_only=True):
    """[window] — windowed least squares (5.39)."""

    length: Annotated[
        int, Meta(ge=8, description="samples; rounded up to whole periods of the excitation")
    ] = 32
    hop: Annotated[int, Meta(ge=1, description="samples between estimates")] = 1


class NoiseSection(Section, frozen=True, kw_only=True):
    """[noise] — standard deviations of the residual of a healthy rig."""

    residual: Annotated[float, Meta(gt=0, description="acceleration residual [m/s^2]")]
    position: Annotated[float, Meta(gt=0, description="position [m]")] = 1e-5
    voltage: Annotated[float, Meta(gt=0, description="voltage [V]")] = 1e-3
    repeat: Annotated[
        tuple[Annotated[float, Meta(gt=0, le=1)], ...],
        Meta(
            description="largest chance that a healthy reading repeats the one before it, in the "
            "order of the channels; empty: no channel is judged for clipping"
        ),
    ] = ()


class DecisionSection(Section, frozen=True, kw_only=True):
    """[decision] — thresholds of departure and friction."""

    false_alarm: Annotated[
        float, Meta(gt=0, lt=1, description="allowed probability of a false alarm in a year")
    ] = 1e-3
    settle: Annotated[int, Meta(ge=0, description="samples skipped after a start")] = 128
    learn: Annotated[int, Meta(ge=16, description="samples of the run's own reference")] = 256
    longest_period: Annotated[int, Meta(ge=4, description="longest period in samples")] = 1024
    longest_hold: Annotated[
        int, Meta(ge=0, description="longest gap bridged by prediction, in samples")
    ] = 2
    least_velocity: Annotated[
        float, Meta(ge=0, description="rms below which friction is not observable [m/s]")
    ] = 0.005
    worst_condition: Annotated[float, Meta(gt=1, description="of the normal matrix")] = 1e8


class BandSection(Section, frozen=True, kw_only=True):
    """[band] — fixed limits of the estimates, for plants whose healthy state has friction."""

    low: Annotated[tuple[float, float], Meta(description="of (theta1, theta2)")]
    high: Annotated[tuple[float, float], Meta(description="of (theta1, theta2)")]


class ReferenceSection(Section, frozen=True, kw_only=True):
    """[[reference]] — one period of the healthy rig under one excitation."""

    periods: Annotated[int, Meta(ge=1, description="number of periods averaged")]
    scale: Annotated[float, Meta(description="amplitude scale, measured over modelled")]
    voltage: Annotated[Floats, Meta(description="[V]")]
    position: Annotated[Floats, Meta(description="[m]")]
    acceleration: Annotated[Floats, Meta(description="measured [m/s^2]")]
    modelled: Annotated[Floats, Meta(description="modelled, before the scale [m/s^2]")]


class PromotedSection(Section, frozen=True, kw_only=True):
    """[promoted] — learnt friction, which is part of the prediction.

    Friction is (coulomb + coulomb_by_direction·sgn v)·sgn v + (viscous + viscous_by_direction·sgn
    v)·v, in units of θ.
    """

    coulomb: Annotated[float, Meta(description="in units of theta1")] = 0.0
    viscous: Annotated[float, Meta(description="in units of theta2")] = 0.0
    coulomb_by_direction: Annotated[float, Meta(description="half the difference, theta1")] = 0.0
    viscous_by_direction: Annotated[float, Meta(description="half the difference, theta2")] = 0.0
    smooth: Annotated[
        float, Meta(ge=0, description="speed over which the sign of v changes, 0: at once [m/s]")
    ] = 0.0
    study: Annotated[str, Meta(description="where it was learnt")] = ""
    sha256: Annotated[str, Meta(description="hash of the study's model and effects")] = ""


class RecordingSection(Section, frozen=True, kw_only=True):
    """[[recording]] — a recording used for commissioning."""

    role: Annotated[str, Meta(description="chirp, healthy or friction")]
    name: Annotated[str, Meta(description="file name")]
    sha256: Annotated[str, Meta(description="hash of the file or of its samples")] = ""


class RigModel(Section, frozen=True, kw_only=True):
    """The model file."""

    sample_rate: Annotated[float, Meta(ge=SLOWEST, le=FASTEST, description="[Hz]")]
    channels: Annotated[tuple[str, ...], Meta(min_length=2, description="input, position, …")]
    accepted_wiring: Annotated[
        tuple[Wiring, ...], Meta(description="which a person has said is as it is to be")
    ] = ()
    plant: Plant
    friction: FrictionSection
    noise: NoiseSection
    velocity: VelocitySection = field(default_factory=VelocitySection)
    window: WindowSection = field(default_factory=WindowSection)
    decision: DecisionSection = field(default_factory=DecisionSection)
    band: BandSection | None = None
    promoted: PromotedSection | None = None
    remainder: RemainderSection | None = None
    motion_range: RangeSection | None = None
    healthy: HealthyLimits | None = None
    scheme: SchemeSection | None = None
    reference: tuple[ReferenceSection, ...] = ()
    recording: tuple[RecordingSection, ...] = ()

    @property
    def signature(self) -> tuple[float, float]:
        """(θ1, θ2) of the fault with which the filter was fitted: (1, γf)."""
        return 1.0, self.friction.gamma


def load_model(path: Path | str) -> RigModel:
    """The model at `path`.

    Raises:
        ConfigError: the file cannot be read or is invalid.
    """
    model = load(path, RigModel)
    check_model(model, path)
    return model


def parse_model(text: str, name: str) -> RigModel:
    """The model in a file's text; `name` is used in error messages.

    Raises:
        ConfigError: it is invalid.
    """
    model = parse(text, RigModel, name)
    check_model(model, name)
    return model


def check_model(model: RigModel, path: Path | str) -> None:
    """Check the consistency of a model.

    Raises:
        ConfigError: the parts of the model are inconsistent.
    """
    _check_references(model, path)
    if isinstance(model.plant, EquationsPlant):
        _check_equations(model, path)
        return
    wanted = 3 if isinstance(model.plant, TransferPlant) else 2
    if len(model.channels) != wanted:
        raise ConfigError(path, "channels", f"{len(model.channels)} names", f"{wanted} names")
    if model.noise.repeat and len(model.noise.repeat) != wanted:
        raise ConfigError(path, "noise.repeat", f"{len(model.noise.repeat)}", f"{wanted} or none")
    if (model.band is None) != isinstance(model.plant, TransferPlant):
        found = "no such section" if model.band is None else "this section"
        expected = "a section [band] for an inertia, and for no other plant"
        raise ConfigError(path, "band", found, expected)
    if isinstance(model.plant, TransferPlant) and not model.plant.function().is_stable:
        raise ConfigError(path, "plant.a", "poles outside the unit circle", "a stable model")
    if not model.friction.function().is_stable:
        raise ConfigError(path, "friction.a", "poles outside the unit circle", "a stable filter")
    if model.promoted and isinstance(model.plant, TransferPlant):
        by_direction = model.promoted.coulomb_by_direction, model.promoted.viscous_by_direction
        if any(by_direction):
            found = "friction that differs by direction"
            raise ConfigError(path, "promoted", found, "such friction for an inertia only")


def _check_references(model: RigModel, path: Path | str) -> None:
    for index, reference in enumerate(model.reference):
        lengths = {len(getattr(reference, name)) for name in _COLUMNS}
        if len(lengths) != 1 or 0 in lengths:
            key = f"reference[{index}]"
            raise ConfigError(path, key, f"columns of {sorted(lengths)} samples", "one length")


def _check_equations(model: RigModel, path: Path | str) -> None:
    for key in ("remainder", "motion_range", "healthy"):
        if getattr(model, key) is None:
            raise ConfigError(path, key, "no such section", "one for a plant of equations")
    assert isinstance(model.plant, EquationsPlant)
    if len(model.plant.names) != len(model.plant.values):
        found = f"{len(model.plant.names)} names, {len(model.plant.values)} values"
        raise ConfigError(path, "plant.values", found, "one value a name")
    if model.promoted or model.band:
        key = "promoted" if model.promoted else "band"
        raise ConfigError(path, key, "this section", "none for a plant of equations")
    assert model.remainder is not None
    assert model.motion_range is not None
    # Compiled loops read as many values as they expect, whether or not there are as many.
    signals, names = len(model.remainder.centre), len(model.motion_range.names)
    for key, values, expected in (
        ("remainder.scale", model.remainder.scale, signals),
        ("remainder.weights", model.remainder.weights, signals + signals * (signals + 1) // 2),
        ("motion_range.low", model.motion_range.low, names),
        ("motion_range.high", model.motion_range.high, names),
    ):
        if len(values) != expected:
            raise ConfigError(path, key, f"{len(values)} values", f"{expected} values")
    assert model.healthy is not None
    _check_steady_motions(model.healthy, path)


def _check_steady_motions(healthy: HealthyLimits, path: Path | str) -> None:
    """Check that every steady motion has all its figures, or that none has some of them."""
    motions = len(healthy.steady_paces)
    for key, of_each in _OF_EACH_MOTION.items():
        values = getattr(healthy, key)
        # Files of earlier versions have pace, size, narrowness and lasting energy only.
        if len(values) != of_each * motions and (values or key in _OF_EVERY_VERSION):
            found, expected = f"{len(values)} values", f"{of_each * motions} values"
            raise ConfigError(path, f"healthy.{key}", found, expected)
    if len(healthy.steady_drive_energies) % BANDS:
        found = f"{len(healthy.steady_drive_energies)} values"
        raise ConfigError(path, "healthy.steady_drive_energies", found, f"{BANDS} for each drive")
    for key in (*_OF_EACH_MOTION, "steady_drive_energies"):
        # The shape of a motion may be unknown.
        values = [value for value in getattr(healthy, key) if not math.isfinite(value)]
        if values and not (key == "steady_skews" and all(map(math.isnan, values))):
            raise ConfigError(path, f"healthy.{key}", f"{values[0]}", "finite values")


_OF_EVERY_VERSION = ("steady_sizes", "steady_narrow", "steady_energies")
_OF_EACH_MOTION = {
    "steady_paces": 1,
    "steady_sizes": 1,
    "steady_narrow": 1,
    "steady_drives": 1,
    "steady_motion_bands": BANDS,
    "steady_energies": 1,
    "steady_shorts": 1,
    "steady_mediums": 1,
    "steady_frictions": 1,
    "steady_onsets": 1,
    "steady_skews": 3,
}
"""Figures of a steady healthy motion, and how many of each."""


_COLUMNS = ("voltage", "position", "acceleration", "modelled")


def model_text(model: RigModel) -> str:
    """The model as TOML."""
    lines = [
        "# Made by `rigwatch commission`; read by `rigwatch monitor` and `rigwatch replay`.",
        "",
    ]
    tables: list[str] = []
    for key, value in structs.asdict(model).items():
        if value is None:
            continue
        if isinstance(value, Section):
            tables += ["", f"[{key}]", *_table(value)]
        elif isinstance(value, tuple) and value and isinstance(value[0], Section):
            for item in value:
                tables += ["", f"[[{key}]]", *_table(item)]
        elif not (isinstance(value, tuple) and not value):
            lines.append(f"{key} = {_toml(value)}")
    return "\n".join(lines + tables) + "\n"


def _table(section: Section) -> list[str]:
    tag = section.__struct_config__.tag
    head = [f'kind = "{tag}"'] if tag else []
    return head + [f"{name} = {_toml(value)}" for name, value in structs.asdict(section).items()]


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple):
        parts = [_toml(item) for item in value]
        if len(parts) <= 6:
            return "[" + ", ".join(parts) + "]"
        rows = [", ".join(parts[i : i + 4]) for i in range(0, len(parts), 4)]
        return "[\n    " + ",\n    ".join(rows) + ",\n]"
    return repr(float(value)) if isinstance(value, float) else str(value)
