"""A user of rigwatch: a study of logs and a shipped model, then explain and add until it stops."""

from pathlib import Path

import numpy as np

import rigwatch
from benchmarks.comparing.task import Part, Task, coarse
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.fit import free_run
from rigwatch.workbench.study import open_study

MODEL = """
name = "plant"
summary = "A mass on a spring and damper."
inputs.force = { unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(force - c*v - k*x + load)/m", rate_of = "position" }
parameters.m = { value = 1.0, unit = "kg", low = 0.01 }
parameters.c = { value = 1.8, unit = "N s/m", low = 0.0 }
parameters.k = { value = 67.5, unit = "N/m", low = 0.0 }
outputs.position = { unit = "m", expression = "x" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
"""What the user writes for a machine that no shipped model describes."""
STUDIES = Path(__file__).parents[2] / "configs" / "studies"
DERIVED = (STUDIES / "emps.toml").read_text("utf-8").partition("[derive]")
SHIPPED = {
    "Silverbox": ("oscillator", "horizon = 3.0", "voltage[V]", "output[V]"),
    "EMPS": ("emps", "horizon = 5.0\nsubsteps = 1", "force[N]", "position[m]"),
}
"""Model, keys of the shipped study, and columns of each measured machine."""
FORCE = ("emps-force", "", "force[N]", "position[m]")
"""EMPS as force from its motion, which names effects; its position shows them in a free run."""
OWN = ("plant.toml", "", "force[N]", "position[m]")
STEPS = 4
"""Most effects that the user adds."""


def lines_written(task: Task) -> int:
    """Lines of the model, unless it is shipped, of the study and of commands."""
    own = 0 if task.name in SHIPPED else len(MODEL.strip().splitlines())
    keys = len(SHIPPED.get(task.name, OWN)[1].splitlines())
    recordings = 2 * len((*task.train, *task.held_out))
    commands = 2 * len(task.effects) + 2
    study = 1 + keys + recordings
    if task.name == "EMPS":
        derived = [x for x in "".join(DERIVED[1:]).splitlines() if x and not x.startswith("#")]
        study += 1 + recordings + len(derived)
    return own + study + commands


def found_by(task: Task, folder: Path) -> tuple[float, str]:
    """Error of free runs over the held-out recordings, and the effects added.

    Args:
        task: the data at the full rate.
        folder: an empty one, for the study.
    """
    if task.name == "EMPS":
        tail = "".join(DERIVED[1:])
        named = _explained(_study(task, folder / "force", FORCE, tail))
        text = (named.folder / "study.toml").read_text("utf-8")
        tables = [line for line in text.splitlines() if not line.startswith("model = {")]
        effects = "\n".join(tables).partition("[[effects]]")
        at = coarse(task)
        study = _study(at, folder / "position", SHIPPED[task.name], "".join(effects[1:]))
    else:
        at = task
        study = _explained(_study(task, folder, SHIPPED.get(task.name, OWN)))
    bench = open_bench(open_study(study.folder))
    errors = [
        free_run(bench.base, Recording(at.dt, part.u[:, None], part.y[:, None]))[0]
        for part in at.held_out
    ]
    weights = [len(part.y) for part in at.held_out]
    names = ", ".join(f"{a.effect}@{a.port}" for a in bench.study.file.effects) or "nothing"
    return float(np.sqrt(np.average(np.square(errors), weights=weights))), names


def _explained(study: rigwatch.Study) -> rigwatch.Study:
    """The study with each effect that is named with confidence and accepted."""
    for _ in range(STEPS):
        verdict = study.explain().found
        if verdict.verdict != "missing_effect":
            break
        best = verdict.ranking[0]
        if study.add(best.effect, port=best.port).found.step != "add":
            break
    return study


def _study(
    task: Task, folder: Path, kind: tuple[str, str, str, str], tail: str = ""
) -> rigwatch.Study:
    """A study of logs, as a user has them; `tail` ends its file."""
    folder.mkdir(exist_ok=True)
    model, keys, *columns = kind
    (folder / "plant.toml").write_text(MODEL)
    text = f'model = "{model}"\n{keys}\n'
    for use, parts in (("train", task.train), ("held_out", task.held_out)):
        for index, part in enumerate(parts):
            _import(task, folder / f"{use}{index}.csv", part, columns)
            text += f'[[{use}]]\nsession = "{use}{index}.mcap"\n'
    (folder / "template.toml").write_text(f"{text}\n{tail}")
    return rigwatch.Study.from_template(folder / "study", folder / "template.toml", folder)


def _import(task: Task, path: Path, part: Part, columns: list[str]) -> None:
    """A CSV file of one recording, and the session made of it."""
    channels = {column.partition("[")[0]: column for column in columns}
    values, head = np.column_stack([part.u, part.y]), ",".join(channels)
    np.savetxt(path, values, "%.9g", ",", header=head, comments="")
    import_file(path, path.with_suffix(".mcap"), ImportMapping(channels=channels, rate=1 / task.dt))
