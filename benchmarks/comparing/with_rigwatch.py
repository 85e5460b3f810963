"""A user of rigwatch: a study of logs and a shipped model, then explain and add until it stops."""

from pathlib import Path

import numpy as np

import rigwatch
from benchmarks.comparing.task import Task
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
SHIPPED = {
    "Silverbox": ("oscillator", "horizon = 3.0", "voltage[V]", "output[V]"),
    "EMPS": ("emps", "horizon = 5.0\nsubsteps = 1", "force[N]", "position[m]"),
}
"""Model, keys of the shipped study, and columns of each measured machine."""
OWN = ("plant.toml", "", "force[N]", "position[m]")
STEPS = 4
"""Most effects that the user adds."""


def lines_written(task: Task) -> int:
    """Lines of the model, unless it is shipped, of the study and of commands."""
    own = 0 if task.name in SHIPPED else len(MODEL.strip().splitlines())
    keys = len(SHIPPED.get(task.name, OWN)[1].splitlines())
    return own + 1 + keys + 2 * len((*task.train, *task.held_out)) + 2 * len(task.effects) + 2


def found_by(task: Task, folder: Path) -> tuple[float, str]:
    """Error of free runs over the held-out recordings, and the effects added.

    Args:
        task: the data.
        folder: an empty one, for the study.
    """
    study = _study(task, folder)
    for _ in range(STEPS):
        verdict = study.explain().found
        if verdict.verdict != "missing_effect":
            break
        best = verdict.ranking[0]
        if study.add(best.effect, port=best.port).found.step != "add":
            break
    bench = open_bench(open_study(study.folder))
    errors = [
        free_run(bench.base, Recording(task.dt, part.u[:, None], part.y[:, None]))[0]
        for part in task.held_out
    ]
    weights = [len(part.y) for part in task.held_out]
    named = ", ".join(f"{a.effect}@{a.port}" for a in bench.study.file.effects) or "nothing"
    return float(np.sqrt(np.average(np.square(errors), weights=weights))), named


def _study(task: Task, folder: Path) -> rigwatch.Study:
    """A study of logs, as a user has them."""
    model, keys, *columns = SHIPPED.get(task.name, OWN)
    (folder / "plant.toml").write_text(MODEL)
    text = f'model = "{model}"\n{keys}\n'
    for use, parts in (("train", task.train), ("held_out", task.held_out)):
        for index, part in enumerate(parts):
            name = f"{use}{index}"
            channels = {column.partition("[")[0]: column for column in columns}
            np.savetxt(
                folder / f"{name}.csv", np.column_stack([part.u, part.y]), "%.9g", ",",
                header=",".join(channels), comments="",
            )  # fmt: skip
            mapping = ImportMapping(channels=channels, rate=1 / task.dt)
            import_file(folder / f"{name}.csv", folder / f"{name}.mcap", mapping)
            text += f'[[{use}]]\nsession = "{name}.mcap"\n'
    (folder / "template.toml").write_text(text)
    return rigwatch.Study.from_template(folder / "study", folder / "template.toml", folder)
