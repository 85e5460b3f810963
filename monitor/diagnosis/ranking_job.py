"""The ranking process, started by the monitor.

    request ─▶ python -m monitor.diagnosis ─▶ answer

A thread would share the interpreter with the monitor's loop, and delay samples while it imports and
computes. Request and answer are files in memory that have no name: a ranking needs no room on a
disk, and a monitor that is killed leaves nothing behind.
"""

import json
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import IO

import numpy as np

from monitor.diagnosis.child import Child
from monitor.model import RigModel, model_text, parse_model
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError

LONGEST = 300
"""Time limit of a job [s]; the first on a machine compiles the effects."""
NICENESS = 10
MODULE = "monitor.diagnosis"


def ask(  # noqa: PLR0917 -- what the request holds
    signals: FloatArray,
    change: FloatArray,
    onset: int,
    model: RigModel,
    effect_files: Sequence[str],
    child: Child | None = None,
) -> str:
    """Wait for the ranking as text; if the job or its `child` was ended, why there is none.

    Raises:
        OSError: the request cannot be kept, or the job not started.
    """
    with _in_memory("request") as request, _in_memory("answer") as told:
        evidence = {"signals": signals, "change": change, "onset": onset}
        texts = {"model": model_text(model), "effects": json.dumps(list(effect_files))}
        np.savez(request, **evidence, **texts)  # type: ignore[arg-type]
        request.seek(0)
        code = (child or Child()).run(["-m", MODULE], request.fileno(), told.fileno())
        told.seek(0)
        text = told.read().decode("utf-8")
    return text if text and not code else failed(_why(code))


@contextmanager
def _in_memory(name: str) -> Iterator[IO[bytes]]:
    """A file in memory; `name` is shown where the kernel lists open files."""
    with os.fdopen(os.memfd_create(f"rigwatch-{name}"), "w+b") as file:
        yield file


def failed(why: str) -> str:
    """The text of a ranking that has failed."""
    return f"probably missing: cannot tell, the ranking failed: {why}"


def _why(code: int) -> str:
    if code == -signal.SIGALRM:
        return f"it took more than {LONGEST} s"
    if code < 0:
        return f"its process was ended by {signal.Signals(-code).name}"
    return f"its process ended with code {code}, the monitor's output says more"


def answer(request: IO[bytes]) -> str:
    """Process a request.

    Raises:
        RigwatchError: a file of effects is malformed.
    """
    from monitor.diagnosis.fault_candidates import in_words, suspects
    from monitor.diagnosis.observed_change import Evidence
    from rigwatch.physics.engine.equations import library, offered

    with np.load(request) as kept:
        evidence = Evidence(kept["signals"], kept["change"], int(kept["onset"]))
        model = parse_model(str(kept["model"]), "the monitor's model")
        files = json.loads(str(kept["effects"]))
    return in_words(suspects(evidence, model, library() | offered(files)))


def main() -> int:
    """0 if there is an answer."""
    os.nice(NICENESS)
    signal.alarm(LONGEST)
    # What a library prints goes to the monitor's own output, and not into the answer.
    told = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    try:
        text = answer(sys.stdin.buffer)
    except RigwatchError as error:
        text = f"probably missing: cannot tell, {error}"
    with os.fdopen(told, "wb") as file:
        file.write(text.encode())
    return 0
