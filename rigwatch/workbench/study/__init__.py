"""A study on disk: its TOML file, its recordings, and the hashed ledger of every step."""

from rigwatch.workbench.study import ledger
from rigwatch.workbench.study.creation import check_new, create, start_study
from rigwatch.workbench.study.edits import (
    append_effect,
    drop_effect,
    keep_holds,
    use_effect_file,
    use_model_file,
    use_variants,
    without_chosen_holds,
)
from rigwatch.workbench.study.elements import Element, elements_of, written_variants
from rigwatch.workbench.study.folder import FILE, LEDGER, digest
from rigwatch.workbench.study.known_values import assumed_values
from rigwatch.workbench.study.ledger import append, check_data, commit, lines, model_hash, stands_on
from rigwatch.workbench.study.moving_parameters import judged_alone
from rigwatch.workbench.study.recording_parameters import Known
from rigwatch.workbench.study.refusals import (
    REFUSED,
    Refusals,
    refusal,
    refusals,
    refused_as,
)
from rigwatch.workbench.study.study import (
    GIVEN,
    HEALTHY,
    RECORDINGS,
    Held,
    Kept,
    Study,
    open_study,
    physics_of,
    study_of,
    varied,
)
from rigwatch.workbench.study.study_file import Accepted, Derive, Derived, Span, StudyFile
from rigwatch.workbench.study.told_units import NOISES, told, told_unit

__all__ = [
    "FILE",
    "GIVEN",
    "HEALTHY",
    "LEDGER",
    "NOISES",
    "RECORDINGS",
    "REFUSED",
    "Accepted",
    "Derive",
    "Derived",
    "Element",
    "Held",
    "Kept",
    "Known",
    "Refusals",
    "Span",
    "Study",
    "StudyFile",
    "append",
    "append_effect",
    "assumed_values",
    "check_data",
    "check_new",
    "commit",
    "create",
    "digest",
    "drop_effect",
    "elements_of",
    "judged_alone",
    "keep_holds",
    "ledger",
    "lines",
    "model_hash",
    "open_study",
    "physics_of",
    "refusal",
    "refusals",
    "refused_as",
    "stands_on",
    "start_study",
    "study_of",
    "told",
    "told_unit",
    "use_effect_file",
    "use_model_file",
    "use_variants",
    "varied",
    "without_chosen_holds",
    "written_variants",
]
