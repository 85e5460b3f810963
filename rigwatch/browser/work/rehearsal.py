"""Rehearsal of a study's model in the monitor, on the rig's latest recorded samples."""

from collections.abc import Callable
from pathlib import Path

from monitor.model import load_model, model_versions
from rigwatch.recorder import newest
from rigwatch.wire.errors import SessionError
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from rigwatch.workbench.steps import Rehearsal, model_path, promotion, rehearse
from rigwatch.workbench.study import Study

MINUTES = 3.0
"""Longest recording used for a rehearsal [min]."""


def model_in_force(rig: Path) -> str:
    """Digest of the model of a rig's monitor, which a rehearsal is compared with."""
    return model_versions.digest_of(model_path(rig))


def rehearsal(study: Study, rig: Path, progress: Callable[[str], None]) -> Rehearsal:
    """Rehearse the study's model.

    Raises:
        ModelError: the monitor's model supports no effect of the study.
        SessionError: the rig has recorded nothing.
    """
    config = load_rig(rig)
    recorder = config.recorder
    if recorder is None:
        raise SessionError(f"{rig}: found no [recorder], expected one that has what the rig did")
    session = open_session(newest(Path(recorder.folder), config.rig.id))
    old = load_model(model_path(rig))
    new = promotion(study, old).model
    progress("rehearsing on what the rig did last")
    last = max((int(block.t_ns[-1]) for block in session.samples()), default=0)
    blocks = list(session.samples(None, last - round(MINUTES * 60e9), None))
    return rehearse(new, old, blocks)
