"""A study on disk: its TOML file, its recordings, and the ledger of every step with hashes."""

from rigwatch.workbench.study import ledger
from rigwatch.workbench.study.ledger import append, check_data, lines, model_hash
from rigwatch.workbench.study.study import (
    GIVEN,
    Accepted,
    Derive,
    Derived,
    Held,
    Kept,
    Span,
    Study,
    StudyFile,
    append_effect,
    create,
    drop_effect,
    keep_holds,
    nearest,
    open_study,
    use_effect_file,
)

__all__ = [
    "GIVEN",
    "Accepted",
    "Derive",
    "Derived",
    "Held",
    "Kept",
    "Span",
    "Study",
    "StudyFile",
    "append",
    "append_effect",
    "check_data",
    "create",
    "drop_effect",
    "keep_holds",
    "ledger",
    "lines",
    "model_hash",
    "nearest",
    "open_study",
    "use_effect_file",
]
