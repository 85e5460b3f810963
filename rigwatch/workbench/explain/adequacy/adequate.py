"""Model adequacy: does the model describe the healthy rig before any effect is added?

If the fit has not converged, or the model describes another machine, the residual of a healthy
recording is far above its noise. Any added effect explains part of it and would be named with
confidence. Another base is then searched for, with the healthy recordings alone, before those with
the fault are looked at; the study's file is not changed, and the verdict says what it is judged on.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import AT_NOISE, Bench, find_base, open_bench
from rigwatch.workbench.data import METHODS, NoiseFloor, from_residual
from rigwatch.workbench.explain.verdict import Verdict, not_converged
from rigwatch.workbench.ranking import Progress
from rigwatch.workbench.study import Study, elements_of, varied

MOST = 5.0
"""Largest ratio of the healthy recording's error to its noise at which a model is adequate."""
ENOUGH = 2.0
"""The same at which the search for an adequate base ends."""
ADVICE = "try another model or other starting values, or record a healthy run that excites it more"
VARIED = "`rigwatch study base {study} --take enough` searches for better variants of the model"

CLOSE = 1.5
"""The same above which a better base is looked for where repeated periods show the noise."""
FEW = 0.005
"""Share of the samples that are few; of white noise they hold 5 % of the energy."""
HALF = 0.5
"""Share of the error's energy in so few samples at which the others do not count."""
ASTRAY = "the fit of the model did not converge"
"""Why no simulated case is similar to an effect that is named although the fits do not agree."""
SHORT = 1000
"""Held-out samples below which no simulated case is similar: those have 5120."""

UNCHECKED = (
    "the model could not be checked on a healthy recording: record one with nothing wrong and list"
    " it under [[healthy]] in the study"
)
JUDGED_ON = (
    "judged on the model with {names}, which the healthy recording asks for; to keep it:"
    ' rigwatch study base {study} --take "{names}"'
)
CHANGE = "the healthy machine has {label} already: what is missing is more of it"
BEYOND = "it acts on what has passed the {element} that the healthy machine has"


def inadequate(bench: Bench) -> Verdict | None:
    """`model_inadequate` if the study's model does not describe the healthy rig, otherwise None.

    A rough model is compared with its own residual on a healthy recording and skips this check.
    """
    healthy = _on_healthy(bench)
    if healthy is None or healthy.adequate:
        return None
    channel = _worst(bench.study.model, healthy.error.rms / healthy.noise.rms)
    text = (
        f"the error on the healthy recording is {healthy.ratio:.3g} times its noise (worst:"
        f" {channel}; {METHODS[healthy.noise.method]}), expected at most {MOST:g}: {ADVICE}"
    )
    return Verdict("model_inadequate", None, (), (), text)


@dataclass(frozen=True)
class _OnHealthy:
    """The model on the healthy recording.

    Attributes:
        error: its fit there.
        noise: of the recording.
    """

    error: Fit
    noise: NoiseFloor

    @cached_property
    def ratio(self) -> float:
        """The error over the noise, over all channels [1]."""
        return self.noise.ratio(self.error)

    @property
    def adequate(self) -> bool:
        """Whether the model describes the healthy rig."""
        return self.ratio <= MOST


def _on_healthy(bench: Bench) -> _OnHealthy | None:
    """The model on the healthy recording; None if it is not checked there."""
    healthy, bare = bench.data.of_healthy, bench.bare
    if healthy is None or bare is None or bench.study.model.rough:
        return None
    noise = from_residual(bare.train, healthy.train, bench.study.file.period, healthy.horizon)
    return _OnHealthy(bare.train, noise)


def stopped_by_outliers(bench: Bench, found: Verdict) -> Verdict:
    """`model_inadequate` if nothing seems missing only because outliers raise the noise floor."""
    if found.word != "nothing_missing":
        return found
    judged = {"held-out": bench.base.held_out}
    if bench.bare is not None:
        judged["healthy"] = bench.bare.held_out
    for use, fitted in judged.items():
        for channel, residual in zip(bench.study.model.outputs, _by_channel(fitted), strict=True):
            count, share = _in_few(residual)
            if share > HALF:
                text = (
                    f"{count} of {len(residual)} samples hold {share:.0%} of the {use} error of"
                    f" {channel}: what is missing cannot be seen beside them; find them with"
                    " `rigwatch locate` and flag or remove them"
                )
                return Verdict("model_inadequate", None, (), (), text)
    return found


def _by_channel(fitted: Fit) -> list[FloatArray]:
    """The valid residuals of each output."""
    series = fitted.residuals.reshape(-1, fitted.residuals.shape[-1])
    return [channel[np.isfinite(channel)] for channel in series.T]


def _in_few(residual: FloatArray) -> tuple[int, float]:
    """The number of samples that are few, and the share of the energy in the largest ones."""
    energy = np.sort(residual**2)[::-1]
    count = math.ceil(FEW * len(energy))
    return count, float(energy[:count].sum() / max(energy.sum(), 1e-300))


def uncalibrated(bench: Bench) -> list[str]:
    """How the recordings differ from those on which verdicts are calibrated, in words.

    Logs with lost rows, uneven times or clocks that differ have a calibration of their own, of
    first verdicts on free runs.
    """
    count = int(np.isfinite(bench.data.held_out.outputs).any(axis=1).sum())
    short = [f"only {count} held-out samples count"] if count < SHORT else []
    counted = not (bench.data.along_motion or bench.study.file.effects)
    ended = bench.base.convergence
    astray = [] if ended is None or ended.converged else [ASTRAY]
    return [*([] if counted else bench.data.altered), *astray, *short]


def with_base_offered(bench: Bench, found: Verdict) -> Verdict:
    """The verdict, with the command that searches for a better base if there may be one."""
    study = bench.study
    searched = study.file.healthy and (study.model.variants or bench.data.along_motion)
    if found.word != "model_inadequate" or not searched:
        return found
    return replace(found, text=f"{found.text}; {VARIED.format(study=study.folder)}")


def unchecked(bench: Bench, found: Verdict) -> Verdict:
    """The verdict for a model along its measured motion if there is no healthy recording.

    Model error and a fault are then indistinguishable. An effect is named only if it leaves nothing
    but noise, and so no model error either. If even the best effect leaves many times that, the
    model does not describe the rig.

    Args:
        bench: the study.
        found: the verdict on its ranking.
    """
    if bench.data.healthy is not None or not bench.data.along_motion:
        return found
    best = found.best.fitted if found.best is not None else None
    ratio = bench.floor.ratio((best or bench.base).held_out)
    if ratio > MOST and found.word != "model_inadequate":
        text = (
            f"with the best known effect the held-out error is {ratio:.3g} times its noise"
            f" ({METHODS[bench.floor.method]}), expected at most {MOST:g}; {UNCHECKED}"
        )
        return Verdict("model_inadequate", None, (), (), text)
    certain = best is not None and bench.floor.reached(best.held_out)
    if found.word != "missing_effect" or certain:
        return found
    text = f"likely, not certain: {found.text}; {UNCHECKED}"
    return replace(found, word="undetermined", text=text)


def _worst(model: Model, ratios: FloatArray) -> str:
    """The output with the largest error over its noise."""
    return list(model.outputs)[int(np.argmax(ratios))]


def with_adequate_base(bench: Bench, progress: Progress) -> Bench:
    """The bench, or one on a base that the healthy recordings ask for.

    One is looked for if the study's own is inadequate, or leaves more than the noise that repeated
    periods show: a rig whose laws differ a little from the model's has effects on healthy days. Of
    an adequate one the search leaves little but noise: what it left would hide small effects.

    Args:
        bench: of a study; one with accepted effects keeps its base.
        progress: called with a line of text as each fit begins.
    """
    if not _may_search(bench):
        return bench
    healthy = _on_healthy(bench)
    lacks = _is_inadequate(bench, healthy)
    if not lacks and not _leaves_more_than_noise(healthy, CLOSE):
        return bench
    told = "does not describe the healthy rig" if lacks else "leaves more than the healthy noise"
    progress(f"the model {told}: searching for a better base")
    return _on_found_base(bench.study, ENOUGH if lacks else AT_NOISE, progress) or bench


def closer_base(bench: Bench, progress: Progress) -> Bench | None:
    """The bench on a base that leaves less of the healthy recordings; None if none is found.

    One that leaves little more than their noise may do so with a wrong response to the motion that
    a wrong response to the drive makes up for. A fault that changes the motion shows it: no effect
    then explains what it leaves. Where it leaves much, `with_adequate_base` has searched.

    Args:
        bench: of a study on its own base.
        progress: called with a line of text as each fit begins.
    """
    healthy = _on_healthy(bench)
    searched = _is_inadequate(bench, healthy) or _leaves_more_than_noise(healthy, CLOSE)
    if searched or not (_may_search(bench) and _leaves_more_than_noise(healthy, AT_NOISE)):
        return None
    progress("no effect explains it on this base: searching for one closer to the healthy rig")
    return _on_found_base(bench.study, AT_NOISE, progress)


def _on_found_base(study: Study, enough: float, progress: Progress) -> Bench | None:
    """The bench on the best base found.

    None if that is the study's own, is inadequate, or cannot be fitted.

    Args:
        study: the study.
        enough: ratio of the error to its noise at which nothing more is looked for.
        progress: called with a line of text as each fit begins.
    """
    try:
        found = find_base(study, progress, enough=enough)
        names = found.enough.variants
        if set(names) == set(study.file.variants):
            return None
        chosen = varied(study, names)
        file = structs.replace(chosen.file, start=found.start | dict(study.file.start))
        progress(f"fitting the model with {', '.join(names)}")
        better = open_bench(replace(chosen, file=file))
    except ModelError:
        return None
    if _is_inadequate(better, _on_healthy(better)):
        return None
    told = JUDGED_ON.format(names=", ".join(names), study=study.folder)
    return replace(better, data=replace(better.data, remarks=(*better.data.remarks, told)))


def with_change_told(study: Study, found: Verdict) -> Verdict:
    """The verdict, which says so if it names an element of the base, or what acts beyond one."""
    labels = {element.label for element in elements_of(study.file.variants)}
    named = sorted(labels & {*found.members})
    told = [CHANGE.format(label=named[0])] if named else []
    fitted = found.best.fitted if found.best is not None else None
    placed = fitted.placements[-1:] if fitted is not None else ()
    told += [BEYOND.format(element=last.beyond) for last in placed if last.beyond]
    return replace(found, text="; ".join([found.text, *told]))


def _may_search(bench: Bench) -> bool:
    study = bench.study
    return bool(bench.data.along_motion and study.file.healthy) and not (
        study.file.effects or study.model.rough
    )


def _leaves_more_than_noise(healthy: _OnHealthy | None, least: float) -> bool:
    """Whether the healthy recording's error is so many times a noise that its periods show."""
    return healthy is not None and healthy.noise.method == "periods" and healthy.ratio > least


def _is_inadequate(bench: Bench, healthy: _OnHealthy | None) -> bool:
    """Whether a fit did not converge, or leaves more of the healthy recording than is adequate."""
    bare, kept = bench.bare, bench.study.kept
    ended = {
        "the model to the healthy recording": bare.convergence if bare else None,
        "the kept parameters to the healthy recording": kept.convergence if kept else None,
    }
    return not_converged(ended) is not None or (healthy is not None and not healthy.adequate)
