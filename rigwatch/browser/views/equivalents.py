"""The shell command and the Python line that do the same as a step on the page."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from rigwatch.workbench.study import Study


@dataclass(frozen=True)
class Equivalent:
    """A step in both forms.

    Attributes:
        what: the step, in words.
        shell: the command, for the folder in which the workbench was started.
        python: the line, for the same folder.
    """

    what: str
    shell: str
    python: str


def step(study: Study, what: str, call: str = "", shell: str = "") -> Equivalent:
    """A step without arguments.

    Args:
        study: the study.
        what: name of the command, such as "explain".
        call: the method with its arguments, `what()` if empty.
        shell: the command before the study's folder, `what` if empty.
    """
    folder = _from_here(study.folder)
    python = f"rigwatch.Study({folder!r}).{call or f'{what}()'}"
    return Equivalent(what, f"rigwatch {shell or what} {shlex.quote(folder)}", _imported(python))


def adding(study: Study, effect: str, port: str) -> Equivalent:
    """Adding an effect."""
    begun = step(study, "add", f'add("{effect}", "{port}")')
    return Equivalent("add", f"{begun.shell} {effect} --port {port}", begun.python)


def every_step(study: Study, rig: Path | None) -> list[Equivalent]:
    """All steps that the page of a study offers, besides adding an effect."""
    name = study.folder.name
    found = [
        step(study, "compare"),
        step(study, "locate"),
        step(study, "explain"),
        step(study, "undo"),
        _with(step(study, "report", f'report("{name}.html")', "study report"), "--output",
              f"{name}.html"),
        step(study, "accept data", "accept_data()", "study accept-data"),
        _with(step(study, "own effect", 'learn("my_effects.toml")', "add"), "--effect-file",
              "my_effects.toml"),
        _with(step(study, "own model", 'remodel("my_model.toml")', "study base"), "--model-file",
              "my_model.toml"),
    ]  # fmt: skip
    if rig is None:
        return found
    config = _from_here(rig)
    promote = step(study, "promote", f"promote({config!r})", "study promote")
    back = step(study, "roll back", f"promote({config!r}, rollback=True)", "study promote")
    return [*found, _with(promote, "--rig", config), _with(back, "--rig", config, "--rollback")]


def _with(found: Equivalent, *words: str) -> Equivalent:
    return Equivalent(found.what, f"{found.shell} {shlex.join(words)}", found.python)


def _from_here(path: Path) -> str:
    """A path relative to the working folder if it is below it, otherwise the whole one."""
    path, here = path.resolve(), Path.cwd().resolve()
    return path.relative_to(here).as_posix() if path.is_relative_to(here) else path.as_posix()


def _imported(line: str) -> str:
    return f"import rigwatch; {line}"
