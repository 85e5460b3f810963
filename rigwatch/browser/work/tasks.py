"""Tasks of a study's process: fit a step, explain, preview, add, undo, report."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigwatch.browser.signals import write_trace
from rigwatch.browser.work.directions import write_directions
from rigwatch.browser.work.results import Results, results_of, signal_key
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Bench, Warm, locate, sample_numbers
from rigwatch.workbench.experiment import Experiment, excitation
from rigwatch.workbench.explain import explained
from rigwatch.workbench.fit import Fitted, block_differences
from rigwatch.workbench.ranking import Ranked, difference
from rigwatch.workbench.report import write_report
from rigwatch.workbench.steps import (
    Stage,
    Trial,
    hand_over,
    signals,
    try_add,
    try_effect,
    try_undo,
)
from rigwatch.workbench.study import Study, ledger, open_study

Progress = Callable[[str], None]
RANKED = "ranked; preparing the previews"


@dataclass
class Worker:
    """A study's process from the inside.

    Attributes:
        folder: the study's.
        progress: called with a line of text as each part begins.
        shown: called once results can be shown, before the task ends.
        warm: cache of fits for the next task.
    """

    folder: Path
    progress: Progress
    shown: Callable[[], None] = lambda: None
    warm: Warm = field(default_factory=lambda: Warm(12))

    def step(self, count: int | None = None) -> Study:
        """The study with its first `number` effects, all if None."""
        study = open_study(self.folder)
        effects = study.file.effects
        return study if count is None else study.with_effects(effects[:count])

    def show(self, step: int | None = None) -> None:
        """Fit the model of a step; writes errors, signals and regions."""
        study = self.step(step)
        kept = results_of(study)
        if kept.has("comparison.json"):
            return
        self.progress("fitting the model")
        bench = self.warm.bench(study)
        self.progress("simulating")
        compared = self.warm.comparison(study)
        _write_signals(kept, Stage("", bench, compared))
        _write_regions(kept, bench)
        kept.write("comparison", compared)
        kept.forget_old()

    def explain(self) -> None:
        """Rank the effects that may be missing, with evidence for each."""
        self.show()
        study = self.step()
        kept, found = results_of(study), explained(self.warm.bench(study), self.progress)
        bench, rows, told = found.bench, found.rows, found.explanation
        self.progress(RANKED)
        kept.write("evidence", {row.label: _evidence(bench, row) for row in rows})
        kept.write("explanation", told)
        self.shown()
        with kept.whole("previews") as folder:
            for row in rows:
                if row.fitted is not None:
                    _write_preview(Results(folder), bench, row.label, row.fitted)
        if told.next_experiment is not None:
            _write_experiment(kept, bench, told.next_experiment)
        with kept.whole("directions") as folder:
            write_directions(folder, bench, rows)

    def preview(self, effect: str, port: str) -> None:
        """Fit one effect at one port, and judge it."""
        study = self.step()
        kept, bench = results_of(study), self.warm.bench(study)
        row = try_effect(study, effect, port, self.progress, self.warm)
        assert row.fitted is not None
        _write_preview(Results(kept.folder / "previews"), bench, row.label, row.fitted)
        told = kept.read("evidence") or {}
        kept.write("evidence", told | {row.label: _evidence(bench, row)})

    def add(self, effect: str, port: str, *, anyway: bool = False) -> dict[str, Any]:
        """Add or refuse an effect; returns the outcome."""
        study = open_study(self.folder)
        return self._done(
            try_add(
                study, effect, port, anyway=anyway, beside=_beside(study, f"{effect}@{port}"),
                progress=self.progress, warm=self.warm,
            )
        )  # fmt: skip

    def undo(self) -> dict[str, Any]:
        """Remove the last effect; returns the outcome."""
        return self._done(try_undo(open_study(self.folder), self.progress, self.warm))

    def accept_data(self) -> dict[str, Any]:
        """Continue with recordings that have changed."""
        ledger.append(open_study(self.folder), "accept-data")
        return {"text": "continues with the recordings as they are now"}

    def report(self) -> None:
        """Write the study's report."""
        study = open_study(self.folder)
        self.show()
        write_report(study, results_of(study).folder / "report.html", self.progress)

    def rehearse(self, rig: str) -> dict[str, Any]:
        """Run the monitor with the study's results over the rig's latest samples."""
        from rigwatch.browser.work.rehearsal import model_in_force, rehearsal

        study = open_study(self.folder)
        self.progress("making the monitor's model")
        against = model_in_force(Path(rig))
        found = rehearsal(study, Path(rig), self.progress)
        results_of(study).write("rehearsal", msgspec.to_builtins(found) | {"against": against})
        raised = f"raises {', '.join(found.alarms)}" if found.alarms else "raises no alarm"
        text = f"over the last {found.seconds:.0f} s the monitor's residual goes from"
        return {"text": f"{text} {found.before:.3g} to {found.after:.3g} m/s^2 and it {raised}"}

    def promote(self, rig: str) -> dict[str, Any]:
        """Promote the study's results to the rig's monitor."""
        return self._handed(rig, rollback=False)

    def rollback(self, rig: str) -> dict[str, Any]:
        """Restore the rig's previous model."""
        return self._handed(rig, rollback=True)

    def _handed(self, rig: str, *, rollback: bool) -> dict[str, Any]:
        study = open_study(self.folder)
        done = hand_over(study, Path(rig), rollback=rollback, say=self.progress)
        return {"step": "done" if done.reply.done else "refused", "text": done.reply.text}

    def _done(self, trial: Trial) -> dict[str, Any]:
        self.progress("writing study and ledger")
        change = trial.commit()
        self.show()
        return {"step": change.step, "text": change.text}


def _beside(study: Study, label: str) -> list[str]:
    """The set in which the last explanation of the study names an effect; empty if it does not."""
    told = results_of(study).read("explanation") or {}
    named = [f"{row['effect']}@{row['port']}" for row in told.get("ranking", [])[:1]]
    return list(told.get("beside", [])) if label in named else []


def _lines(bench: Bench, fitted: Fitted, *, held_out: bool) -> tuple[FloatArray, FloatArray]:
    """Residuals of the fit, shape (n, outputs), and their times [s]."""
    recording = bench.data.held_out if held_out else bench.data.train
    found = fitted.held_out if held_out else fitted.train
    flat = found.residuals.reshape(-1, found.residuals.shape[-1])
    rows = sample_numbers(recording, len(flat))
    return flat[: len(rows)], np.asarray(rows * recording.dt, np.float64)


def _write_signals(kept: Results, stage: Stage) -> None:
    bench = stage.bench
    with kept.whole("signals") as folder:
        for use in ("train", "held_out"):
            shown = signals(stage, held_out=use == "held_out")
            dt = float(shown.time[1] - shown.time[0]) if len(shown.time) > 1 else 1.0
            residual, times = _lines(bench, bench.base, held_out=use == "held_out")
            for k, channel in enumerate(bench.study.model.outputs):
                for line, values in (("measured", shown.measured), ("modelled", shown.modelled)):
                    write_trace(folder, signal_key(use, line, channel), values[:, k], dt)
                write_trace(folder, signal_key(use, "residual", channel), residual[:, k], times)


def _write_regions(kept: Results, bench: Bench) -> None:
    regions = locate(bench)
    plain = [
        {name: getattr(r, name) for name in r.__dataclass_fields__ if name != "samples"}
        | {"count": len(r.samples)}
        for r in regions
    ]
    kept.write("regions", plain)
    with kept.whole("places") as folder:
        dt = bench.data.train.dt
        for number, region in enumerate(regions):
            if len(region.samples):
                np.save(folder / f"{number}.npy", region.samples * dt)


def _write_preview(kept: Results, bench: Bench, label: str, fitted: Fitted) -> None:
    with kept.whole(label) as folder:
        for use in ("train", "held_out"):
            residual, times = _lines(bench, fitted, held_out=use == "held_out")
            for k, channel in enumerate(bench.study.model.outputs):
                write_trace(folder, signal_key(use, "residual", channel), residual[:, k], times)


def _write_experiment(kept: Results, bench: Bench, proposed: Experiment) -> None:
    """Write the proposed excitation as CSV."""
    inputs, names = excitation(bench, proposed), list(bench.study.model.inputs)
    times = np.arange(len(inputs)) * bench.data.train.dt
    head = ["time [s]", *(f"{n} [{bench.study.model.inputs[n].unit}]" for n in names)]
    whole = np.column_stack([times, inputs])
    path = kept.folder / "experiment.csv"
    np.savetxt(path, whole, "%.9g", ",", header=",".join(head), comments="")


def _evidence(bench: Bench, row: Ranked) -> Mapping[str, Any]:
    """Evidence for a row: to first order and, if fitted, per block."""
    base = bench.base
    told: dict[str, Any] = {
        "first_order": float(base.train_error * np.sqrt(max(1 - row.explained, 0.0))),
        "reason": row.reason,
        "accepted": row.accepted,
        "fitted": row.fitted is not None,
        "kind": row.kind,
    }
    if row.fitted is None:
        return told
    found = difference(base.held_out, row.fitted.held_out)
    return told | {
        "train_error": row.fitted.train_error,
        "held_out_error": row.fitted.held_out_error,
        "chance": found.p_falls,
        "blocks": block_differences(base.held_out, row.fitted.held_out).tolist(),
    }


TASKS: Mapping[str, Callable[..., Any]] = {
    "show": Worker.show,
    "explain": Worker.explain,
    "preview": Worker.preview,
    "add": Worker.add,
    "undo": Worker.undo,
    "accept_data": Worker.accept_data,
    "report": Worker.report,
    "rehearse": Worker.rehearse,
    "promote": Worker.promote,
    "rollback": Worker.rollback,
}
