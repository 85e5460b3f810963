"""A study as an object: the commands as methods.

    study = rigwatch.Study.new("drive", model="motor", data={"run": frame})
    study.explain()
    study.add("coulomb")
    study.plot_where()

Commands, pages and Python work on the same folder and ledger: a study changed elsewhere is read
again. Fits are kept in memory until the study changes.
"""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.wire.errors import ModelError
from rigwatch.wire.exchange import ImportMapping
from rigwatch.wire.typed_files import read_text
from rigwatch.workbench.api.data_frames import NamedArrays, columns_from, records, write_csv
from rigwatch.workbench.api.shown import Rows, Shown
from rigwatch.workbench.compare import Comparison, Region, Warm, locate
from rigwatch.workbench.explain import Explanation, explained
from rigwatch.workbench.report import (
    change_lines,
    comparison_lines,
    explanation_lines,
    region_lines,
    write_report,
)
from rigwatch.workbench.steps import (
    Change,
    Logs,
    Stage,
    hand_over,
    learn,
    remodel,
    signals,
    stages,
    study_from_logs,
    try_add,
    try_undo,
)
from rigwatch.workbench.study import Study as Opened
from rigwatch.workbench.study import append, create, open_study, stands_on

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_REGIONS = 3
Data = Mapping[str, Any] | Sequence[Path | str] | Path | str


class Study:
    """A study in a folder.

    Args:
        folder: of the study.

    Raises:
        ConfigError: there is none, or its file is invalid.
        ModelError: its model or one of its effects is unknown.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self._warm = Warm()
        self._opened()

    @classmethod
    def new(
        cls,
        folder: Path | str,
        *,
        model: str,
        data: Data,
        healthy: Data = (),
        channels: Mapping[str, str] | None = None,
        time: str = "",
        rate: float | None = None,
        start: Mapping[str, float] | None = None,
        known: Mapping[str, Mapping[str, float]] | None = None,
        stated: Mapping[str, str] | None = None,
    ) -> "Study":
        """Create a study from recordings and a model (`rigwatch study new --data`).

        Args:
            folder: new folder.
            model: name of a shipped model, or a model file.
            data: recordings by name, each arrays by name, a data frame or a file; or files. Column
                names may include a unit, such as "speed[rpm]".
            healthy: recordings of the healthy machine, in the same form.
            channels: column of a channel, with its unit, if the names do not match.
            time: column of the time, with its unit, if it is not called time.
            rate: sample rate [Hz], without a time.
            start: known parameters of the model, in their units.
            known: those that hold for one recording alone, by its name.
            stated: those that each file states beside its columns, such as "mass" or "mass[g]".

        Raises:
            ConfigError: the folder holds a study already.
            ImportDataError: a recording cannot be read.
            ModelError: the model is unknown, or its signals are not among the columns.
        """
        mapping = ImportMapping(channels=dict(channels or {}), time=time, rate=rate)
        with tempfile.TemporaryDirectory() as place:
            logs = Logs(
                _files(data, Path(place)), model, _files(healthy, Path(place)), mapping,
                start or {}, known or {}, stated or {},
            )  # fmt: skip
            study_from_logs(Path(folder), logs)
        return cls(folder)

    @classmethod
    def from_template(
        cls, folder: Path | str, template: Path | str, sessions: Path | str | None = None
    ) -> "Study":
        """Create a study from a template (`rigwatch study new --template`)."""
        create(folder, template, sessions)
        return cls(folder)

    def compare(self) -> Shown[Comparison]:
        """Errors, noise floor and parameters (`rigwatch compare`)."""
        return Shown(self._warm.comparison(self._opened()), comparison_lines, _parameters)

    def locate(self) -> Shown[list[Region]]:
        """Where the model fails (`rigwatch locate`)."""
        found = locate(self._warm.bench(self._opened()))
        return Shown(found, lambda regions: region_lines(regions, MOST_REGIONS), _regions)

    def explain(self) -> Shown[Explanation]:
        """Effects that may be missing (`rigwatch explain`)."""
        bench = self._warm.bench(self._opened())
        return Shown(explained(bench).explanation, explanation_lines, _ranking)

    def add(
        self,
        effect: str,
        port: str | None = None,
        *,
        anyway: bool = False,
        beside: Sequence[str] = (),
    ) -> Shown[Change]:
        """Add an effect to the model if the held-out error supports it (`rigwatch add`)."""
        trial = try_add(self._opened(), effect, port, anyway=anyway, beside=beside, warm=self._warm)
        change = trial.commit()
        return Shown(change, change_lines, _errors)

    def undo(self) -> Shown[Change]:
        """Remove the last effect (`rigwatch undo`)."""
        return Shown(try_undo(self._opened(), warm=self._warm).commit(), change_lines, _errors)

    def learn(self, path: Path | str) -> list[str]:
        """Copy an own effect file into the study (`rigwatch add --effect-file`); its effects."""
        return learn(self._opened(), Path(path))[1]

    def remodel(self, path: Path | str) -> None:
        """Copy an own model file into the study and use it (`rigwatch study base --model-file`)."""
        path = Path(path)
        remodel(self._opened(), path.name, read_text(path))

    def accept_data(self) -> None:
        """Continue with recordings that have changed (`rigwatch study accept-data`)."""
        append(self._opened(), "accept-data")

    def promote(self, rig: Path | str, *, rollback: bool = False) -> str:
        """Pass the model to a rig's monitor, or restore its previous one (`study promote`).

        Returns:
            The monitor's answer.

        Raises:
            ModelError: the monitor refuses, or the residual does not fall.
        """
        done = hand_over(self._opened(), Path(rig), rollback=rollback).reply
        if not done.done:
            raise ModelError(f"{rig}: {done.text}")
        return done.text

    def signals(self, *, held_out: bool = True) -> NamedArrays:
        """Time [s], and for each output its measured and modelled values and the residual."""
        stage = self._current()
        found = signals(stage, held_out=held_out)
        columns = NamedArrays(time=found.time)
        for index, name in enumerate(stage.bench.study.model.outputs):
            columns[name] = found.measured[:, index]
            columns[f"{name} modelled"] = found.modelled[:, index]
            columns[f"{name} residual"] = found.residual[:, index]
        return columns

    def steps(self) -> NamedArrays:
        """Errors of each step: the model alone, with its first effect, and so on."""
        return records(
            {"step": stage.label} | _totals(stage.comparison) for stage in self._stages()
        )

    def report(self, path: Path | str) -> Path:
        """Write the study's report (`rigwatch study report`); return its path."""
        write_report(self._opened(), Path(path))
        return Path(path)

    def plot_signals(self, channel: str = "") -> "Figure":
        """Measured and modelled output, and the residual below with the noise floor."""
        from rigwatch.workbench.api import plots

        return plots.signals(self._current(), channel)

    def plot_where(self, channel: str = "") -> "Figure":
        """Mean residual over position and velocity, or over time if the model has no motion."""
        from rigwatch.workbench.api import plots

        return plots.where(self._current(), channel)

    def plot_steps(self) -> "Figure":
        """Errors of each step against the noise floor."""
        from rigwatch.workbench.api import plots

        return plots.steps(self._stages())

    def _opened(self) -> Opened:
        return open_study(self.folder)

    def _current(self) -> Stage:
        study = self._opened()
        return Stage("", self._warm.bench(study), self._warm.comparison(study))

    def _stages(self) -> list[Stage]:
        study = self._opened()
        return self._warm.get(("stages", stands_on(study)), lambda: stages(study))

    def __repr__(self) -> str:
        file = self._opened().file
        effects = "".join(f" + {a.effect}@{a.port}" for a in file.effects)
        return f"Study({str(self.folder)!r}): {file.model}{effects}"


def _files(data: Data, folder: Path) -> tuple[Path, ...]:
    """Recordings as files; tables are written to `folder`."""
    if isinstance(data, (str, Path)):
        return (Path(data),)
    if not isinstance(data, Mapping):
        return tuple(Path(path) for path in data)
    paths = []
    for name, table in data.items():
        path = Path(table) if isinstance(table, (str, Path)) else folder / f"{name}.csv"
        if not isinstance(table, (str, Path)):
            write_csv(columns_from(table, name), path)
        paths.append(path)
    return tuple(paths)


def _totals(found: Comparison) -> dict[str, object]:
    return {
        "train_error": found.train_error,
        "held_out_error": found.held_out_error,
        "noise_floor": found.noise_floor,
        "unit": found.unit,
    }


def _parameters(found: Comparison) -> Rows:
    return [
        {
            "parameter": name,
            "value": value.value,
            "low": value.interval[0] if value.interval else None,
            "high": value.interval[1] if value.interval else None,
            "unit": value.unit,
        }
        for name, value in found.parameters.items()
    ]


def _regions(found: list[Region]) -> Rows:
    keys = ("channel", "view", "name", "rms", "mean", "share", "p_value")
    return [{key: getattr(region, key) for key in keys} for region in found]


def _ranking(found: Explanation) -> Rows:
    keys = ("effect", "port", "train_error", "held_out_error", "p_value", "accepted", "reason")
    return [{key: getattr(row, key) for key in keys} for row in found.ranking]


def _errors(found: Change) -> Rows:
    pairs = (("before", found.before), ("after", found.after))
    return [{"when": when} | _totals(compared) for when, compared in pairs]
