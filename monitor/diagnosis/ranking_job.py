"""The ranking process, started by the monitor.

    python -m monitor.diagnosis FOLDER

A thread would share the interpreter with the monitor's loop, and delay samples while it imports and
computes. The folder holds the request, and receives the answer.
"""

import json
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from monitor.diagnosis.child import Child
from monitor.model import RigModel, load_model, model_text
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError

LONGEST = 300
"""Time limit of a job [s]; the first on a machine compiles the effects."""
NICENESS = 10
MODULE = "monitor.diagnosis"
_EVIDENCE, _MODEL, _EFFECTS, _ANSWER = "evidence.npz", "model.toml", "effects.json", "answer.txt"


def ask(  # noqa: PLR0917 -- what is put into the folder
    folder: Path,
    signals: FloatArray,
    change: FloatArray,
    onset: int,
    model: RigModel,
    effect_files: Sequence[str],
    child: Child | None = None,
) -> str:
    """Wait for the ranking as text; if the job or its `child` was ended, why there is none.

    Raises:
        OSError: the folder cannot be written, or the job not started.
    """
    np.savez(folder / _EVIDENCE, signals=signals, change=change, onset=onset)
    (folder / _MODEL).write_text(model_text(model), encoding="utf-8")
    (folder / _EFFECTS).write_text(json.dumps(list(effect_files)), encoding="utf-8")
    code = (child or Child()).run(["-m", MODULE, str(folder)])
    answer = folder / _ANSWER
    return answer.read_text(encoding="utf-8") if answer.exists() else failed(_why(code))


def failed(why: str) -> str:
    """The text of a ranking that has failed."""
    return f"probably missing: cannot tell, the ranking failed: {why}"


def _why(code: int) -> str:
    if code == -signal.SIGALRM:
        return f"it took more than {LONGEST} s"
    if code < 0:
        return f"its process was ended by {signal.Signals(-code).name}"
    return f"its process ended with code {code}, the monitor's output says more"


def answer(folder: Path) -> str:
    """Process the request in `folder`.

    Raises:
        RigwatchError: a file of effects is malformed.
    """
    from monitor.diagnosis.fault_candidates import in_words, suspects
    from monitor.diagnosis.observed_change import Evidence
    from rigwatch.physics.engine.equations import library, offered

    with np.load(folder / _EVIDENCE) as kept:
        evidence = Evidence(kept["signals"], kept["change"], int(kept["onset"]))
    files = json.loads((folder / _EFFECTS).read_text(encoding="utf-8"))
    effects = library() | offered(files)
    return in_words(suspects(evidence, load_model(folder / _MODEL), effects))


def main() -> int:
    """0 if there is an answer."""
    os.nice(NICENESS)
    signal.alarm(LONGEST)
    folder = Path(sys.argv[1])
    # Written to a temporary file and renamed, so that an answer is complete or absent.
    beside = folder / "answer.new"
    try:
        text = answer(folder)
    except RigwatchError as error:
        text = f"probably missing: cannot tell, {error}"
    beside.write_text(text, encoding="utf-8")
    beside.replace(folder / _ANSWER)
    return 0
