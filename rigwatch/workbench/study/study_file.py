"""The sections of `study.toml`."""

from typing import Annotated, Literal

from msgspec import Meta, field

from rigwatch.physics.engine.equations import Hold, Input, Output
from rigwatch.wire.typed_files import Section

Lateness = Annotated[float, Meta(ge=-1, le=1)]


class Span(Section, frozen=True, kw_only=True):
    """A recording, or a part of one."""

    session: Annotated[str, Meta(description="session file, relative to the study's folder")]
    start: Annotated[float, Meta(ge=0, description="start of the part in the session [s]")] = 0.0
    end: Annotated[float, Meta(description="end of the part in the session [s]")] = float("inf")
    parameters: Annotated[
        dict[str, float],
        Meta(description="model parameters known for this recording, in their units"),
    ] = field(default_factory=dict)


class Derived(Section, frozen=True, kw_only=True):
    """A signal derived from a channel: low-passed and differentiated."""

    channel: Annotated[str, Meta(description="source channel")]
    order: Annotated[int, Meta(ge=0, le=2, description="number of differentiations")] = 0


class Derive(Section, frozen=True, kw_only=True):
    """Signals derived from channels."""

    low_pass: Annotated[float, Meta(gt=0, description="zero-phase Butterworth of order 4 [Hz]")]
    signals: Annotated[dict[str, Derived], Meta(description="the signals, by name")]


class Thin(Section, frozen=True, kw_only=True):
    """Decimation of residuals: low-pass, then every n-th sample."""

    factor: Annotated[int, Meta(ge=1, description="decimation factor")] = 1
    edge: Annotated[int, Meta(ge=0, description="samples dropped at both ends after it")] = 0


class Accepted(Section, frozen=True, kw_only=True):
    """An accepted effect."""

    effect: Annotated[str, Meta(description="its name")]
    port: Annotated[str, Meta(description="its port")]
    parameters: Annotated[
        dict[str, float], Meta(description="initial values of its fit, in the parameters' units")
    ] = field(default_factory=dict)
    model: Annotated[
        dict[str, float],
        Meta(
            description="initial values of the rest of the model, from its accepted fit; with kept"
            " parameters among them, these are shared with the healthy recording"
        ),
    ] = field(default_factory=dict)
    ahead: Annotated[
        bool,
        Meta(description="whether a signal passes it before the effects that are listed earlier"),
    ] = False
    beyond: Annotated[
        str, Meta(description="element of the base that a signal passes first, see `variants`")
    ] = ""


class StudyFile(Section, frozen=True, kw_only=True):
    """The file `study.toml`."""

    model: Annotated[str, Meta(description="name of a shipped model, or a model file")]
    variants: Annotated[
        tuple[str, ...],
        Meta(
            description="model variants in use, and effects that the healthy machine has, as"
            " `effect@port(parameter=value …)` in SI, see `rigwatch study base`"
        ),
    ] = ()
    train: Annotated[tuple[Span, ...], Meta(min_length=1, description="training recordings")]
    held_out: Annotated[
        tuple[Span, ...], Meta(min_length=1, description="recordings that judge effects")
    ]
    healthy: Annotated[
        tuple[Span, ...], Meta(description="recordings of the healthy rig, for the noise floor")
    ] = ()
    horizon: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(
            description="time between re-initialisations [s]; chosen from the data and the model's"
            " time constants if not given"
        ),
    ] = None
    half_windows: Annotated[
        bool,
        Meta(
            description="whether the end of a recording counts that fills at least half of a"
            " horizon; so it does where the horizon is chosen"
        ),
    ] = False
    prediction: Annotated[
        Literal["auto", "measured motion", "free"],
        Meta(
            description="along the measured motion, or free runs over horizons; auto: along the"
            " motion if channels show some of the model's states but not all, and every parameter"
            " that acts on an output of a free run then still acts on one"
        ),
    ] = "auto"
    rate: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(description="common sample rate of all recordings [Hz]; their own if not given"),
    ] = None
    substeps: Annotated[int, Meta(ge=1, description="integration steps per sample")] = 2
    period: Annotated[float, Meta(ge=0, description="period of the excitation [s]; 0: find")] = 0.0
    channels: Annotated[
        dict[str, str], Meta(description="channel of a model's signal, if its name differs")
    ] = field(default_factory=dict)
    shown: Annotated[
        dict[str, str],
        Meta(
            description="unit in which an output's errors are told, the model file's if not given"
        ),
    ] = field(default_factory=dict)
    noise: Annotated[
        dict[str, Annotated[float, Meta(gt=0)]],
        Meta(
            description="standard deviation of an output's noise in a sample, in the unit in which"
            " it is shown, as from a data sheet: the noise floor where no recording tells it"
        ),
    ] = field(default_factory=dict)
    start: Annotated[
        dict[str, float],
        Meta(
            description="initial values of model parameters, in their units; a fixed parameter"
            " keeps the value"
        ),
    ] = field(default_factory=dict)
    deviation: Annotated[
        dict[str, Annotated[float, Meta(ge=0)]],
        Meta(
            description="standard deviations of fixed parameters, for example of a weighed mass, in"
            " their units; 0 if `start` gives the value alone"
        ),
    ] = field(default_factory=dict)
    hold: Annotated[
        dict[str, Hold],
        Meta(description="inputs between samples; chosen from the data if not given"),
    ] = field(default_factory=dict)
    late: Annotated[
        dict[str, Lateness],
        Meta(
            description="delay of held inputs, as a share of the sample period; -1 if a row has the"
            " value of the interval that ends there"
        ),
    ] = field(default_factory=dict)
    holds_chosen: Annotated[
        bool,
        Meta(
            description="whether `hold` and `late` were chosen from the recordings: further effects"
            " may show that they stand for something slow"
        ),
    ] = False
    derive: Derive | None = None
    thin: Thin | None = None
    effect_files: Annotated[
        tuple[str, ...], Meta(description="own effects: TOML files, relative to the study's folder")
    ] = ()
    whole_library: Annotated[
        bool, Meta(description="also rank the elective effects of the library")
    ] = False
    effects: Annotated[tuple[Accepted, ...], Meta(description="accepted effects, in order")] = ()

    def channel_of(self, name: str, signal: Input | Output) -> str:
        """The channel that a signal of the model is read from or compared with."""
        return self.channels.get(name, signal.channel or name)
