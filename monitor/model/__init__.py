"""The monitor's model file and its versions."""

from monitor.model import model_versions
from monitor.model.model_file import (
    BandSection,
    DecisionSection,
    FrictionSection,
    InertiaPlant,
    NoiseSection,
    PromotedSection,
    RecordingSection,
    ReferenceSection,
    RigModel,
    TransferPlant,
    VelocitySection,
    WindowSection,
    load_model,
    model_text,
    parse_model,
)
from monitor.model.observer_sections import (
    BANDS,
    EquationsPlant,
    HealthyLimits,
    RangeSection,
    RemainderSection,
    SchemeSection,
)

__all__ = [
    "BANDS",
    "BandSection",
    "DecisionSection",
    "EquationsPlant",
    "FrictionSection",
    "HealthyLimits",
    "InertiaPlant",
    "NoiseSection",
    "PromotedSection",
    "RangeSection",
    "RecordingSection",
    "ReferenceSection",
    "RemainderSection",
    "RigModel",
    "SchemeSection",
    "TransferPlant",
    "VelocitySection",
    "WindowSection",
    "load_model",
    "model_text",
    "model_versions",
    "parse_model",
]
