"""Blocks of many rigs read from and written to bytes by compiled loops, a rig in each row.

    bytes of a block ─▶ Form: the bytes that blocks of a boot share ─▶ read_block ─▶ numbers
    numbers ─▶ write_block, with the heads that `EstimateHeads` keeps ─▶ bytes of a block

A form and heads are made by the one encoding there is (`packed`, `packed_encoding`), so the bytes
are the same; what a form does not fit is left to it.
"""

from rigwatch.wire.messages.rows.estimate_rows import (
    LONGEST_HEAD,
    EstimateHeads,
    Heads,
    estimate_size,
    source_head,
    write_block,
)
from rigwatch.wire.messages.rows.sample_rows import (
    LONGEST_BLOCK,
    MOST_COLUMNS,
    MOST_FORMS,
    MOST_SAMPLES,
    Form,
    Forms,
    form_of,
    new_forms,
    read_block,
    store_form,
)

__all__ = [
    "LONGEST_BLOCK",
    "LONGEST_HEAD",
    "MOST_COLUMNS",
    "MOST_FORMS",
    "MOST_SAMPLES",
    "EstimateHeads",
    "Form",
    "Forms",
    "Heads",
    "estimate_size",
    "form_of",
    "new_forms",
    "read_block",
    "source_head",
    "store_form",
    "write_block",
]
