"""Effects that `add` refused in a study's present state, as its ledger tells.

`explain` compares single fits; `add` also fits the changed study anew, as every later step does.
What does not keep its gain there is not named again before the study has changed.
"""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from rigwatch.version import __version__
from rigwatch.workbench.study.ledger import data_hashes, lines
from rigwatch.workbench.study.study import Study

Refusals = Mapping[tuple[str, ...], str]
"""Reasons by the effect, as "effect@port", and the others of its set, sorted."""
REFUSED = "refused"
"""The ledger's name of such a step."""


def refused_as(label: str, others: Sequence[str]) -> tuple[str, ...]:
    """The key of a refusal: an effect, as "effect@port", and the others of its set."""
    return label, *sorted(others)


def refusal(study: Study, others: Sequence[str]) -> dict[str, Any]:
    """What the ledger keeps of a refusal beside its numbers.

    Args:
        study: as opened.
        others: the other effects of the set that it was refused in, as "effect@port".

    Raises:
        ModelError: a recording is missing.
    """
    return {"with": sorted(others), "opened": _state(study)}


def refusals(study: Study) -> dict[tuple[str, ...], str]:
    """Reasons of the refusals, by the effect, as "effect@port", and the others of its set, sorted.

    A refusal of an effect in a set holds for the effect alone, too.

    Raises:
        ModelError: a recording is missing.
    """
    refused = [line for line in lines(study) if line.get("step") == REFUSED and "opened" in line]
    now = _state(study) if refused else ""
    found: dict[tuple[str, ...], str] = {}
    for line in refused:
        if line["opened"] == now:
            label, reason = f"{line['effect']}@{line['port']}", line["reason"]
            found |= {refused_as(label, others): reason for others in ((), line["with"])}
    return found


def _state(study: Study) -> str:
    """SHA-256 of what is on disk: the study's file, its own files and its recordings."""
    whole = (study.text, dict(study.own_files), data_hashes(study), __version__)
    return hashlib.sha256(msgspec.json.encode(whole, order="deterministic")).hexdigest()
