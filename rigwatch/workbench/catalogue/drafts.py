"""Checks the text of an own effect or model file before it is saved, with pictures of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rigwatch.physics.engine.equations import Effect, Model, parse_effects, parse_model
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.catalogue.effect_curves import Curve, effect_curves
from rigwatch.workbench.catalogue.findings import SEVERE, findings
from rigwatch.workbench.catalogue.model_report import ModelReport, inputs_of_run, model_report
from rigwatch.workbench.catalogue.problems import Problem, problem, remark
from rigwatch.workbench.steps import check_effect


@dataclass(frozen=True, eq=False)
class Draft:
    """A checked text.

    Attributes:
        problems: what is wrong, with its place.
        drawn: curves by the name of the effect, or of the model.
        told: a line on each effect, or on the model.
    """

    problems: tuple[Problem, ...]
    drawn: Mapping[str, tuple[Curve, ...]]
    told: tuple[str, ...]

    @property
    def usable(self) -> bool:
        """Whether it can be saved."""
        return not any(one.severe for one in self.problems)


def draft_of_effects(text: str, name: str, model: Model) -> Draft:
    """Check a file of effects against the ports of a model.

    Args:
        text: of the file.
        name: of the file.
        model: model with the ports at which the effects are to act.
    """
    try:
        found = parse_effects(text, name)
    except RigwatchError as error:
        return Draft((problem(error, text, name),), {}, ())
    problems, drawn, told = [], {}, []
    for label, effect in found.items():
        try:
            port = check_effect(model, label, effect, Path(name))
            drawn[label] = effect_curves(effect)
            told.append(f"{label}: at {_places(effect, model)}; drawn for {_unit(port, model)}")
        except RigwatchError as error:
            problems.append(_of_effect(error, text, name, label))
    return Draft(tuple(problems), drawn, tuple(told))


def _of_effect(error: RigwatchError, text: str, name: str, label: str) -> Problem:
    """The place of an error within an effect's own table."""
    found = problem(error, text, name)
    if found.line:
        return found
    return remark(text, f"effects.{label}", found.text, severe=True)


def _places(effect: Effect, model: Model) -> str:
    return ", ".join(name for name, port in model.ports.items() if effect.fits(port.kind))


def _unit(port: str, model: Model) -> str:
    return f"a sine of amplitude 1 in SI units ({port} of {model.name})"


def draft_of_model(text: str, name: str) -> Draft:
    """Check a model's file as `rigwatch model check` does, with its run after a step."""
    try:
        model = parse_model(text, name)
        report = model_report(model, {}, name)
    except RigwatchError as error:
        return Draft((problem(error, text, name),), {}, ())
    problems = [
        remark(text, _table(model, one), told, severe=kind in SEVERE)
        for kind, (names, told) in findings(report).items()
        for one in names
    ]
    if report.trouble:
        problems.append(Problem(0, 0, 0, report.trouble))
    return Draft(tuple(problems), {model.name: report.run}, (_summary(model, report),))


def _table(model: Model, name: str) -> str:
    """The table that a finding is about; one on a variable, "port.variable", is at its port."""
    if "." in name:
        return f"ports.{name.partition('.')[0]}"
    tables = ("parameters", "inputs", "quantities", "states")
    return next((f"{table}.{name}" for table in tables if name in getattr(model, table)), name)


def _summary(model: Model, report: ModelReport) -> str:
    parts = f"{len(model.states)} states, {len(model.parameters)} parameters"
    held = inputs_of_run(model, report)
    run = f"; run with {held}" if held else ""
    return f"{model.name}: equations and units are consistent; {parts}{run}"
