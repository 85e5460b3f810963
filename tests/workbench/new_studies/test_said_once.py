"""What is said of a study and no longer holds, or holds for other studies only."""

from pathlib import Path

import numpy as np

from rigwatch.browser.views.study_state import state_of
from rigwatch.browser.work import results_of
from rigwatch.workbench.explain import explain
from rigwatch.workbench.steps import Logs, study_from_logs
from rigwatch.workbench.study import REFUSED, Study, append, refusal
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

CAR = """
name = "platform"
summary = "A mass on a spring, on a platform whose motion is commanded; a wheel that nobody sees."
hold = "linear"
inputs.u = { unit = "m" }
parameters.k = { value = 40.0, unit = "1/s^2" }
parameters.c = { value = 2.0, unit = "1/s" }
parameters.r = { value = 5.0, unit = "1/s" }
states.z = { unit = "m", derivative = "w", measured = "z" }
states.w = { unit = "m/s", derivative = "k*(q - z) - c*w" }
states.q = { unit = "m", derivative = "r*(u - q)" }
outputs.z = { unit = "m", expression = "z" }
outputs.a = { unit = "m/s^2", expression = "k*(q - z) - c*w" }
"""


def test_an_explanation_is_forgotten_once_what_it_names_was_refused(tmp_path: Path) -> None:
    study = studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)
    found = explain(study)
    assert found.verdict == "missing_effect"
    results_of(study).write("explanation", found)
    named = found.ranking[0]
    _refuse(study, "linear_stiffness", "load")
    kept = state_of(study.folder, "study").explanation
    assert kept is not None
    assert kept.text == found.text
    _refuse(study, named.effect, named.port)
    assert state_of(study.folder, "study").explanation is None


def _refuse(study: Study, effect: str, port: str) -> None:
    line = {"effect": effect, "port": port, "reason": "refitted, it leaves as much"}
    append(study, REFUSED, **line, **refusal(study, []))


def test_a_new_study_tells_that_it_is_predicted_along_its_measured_motion(tmp_path: Path) -> None:
    (tmp_path / "platform.toml").write_text(CAR)
    logs = tuple(_log(tmp_path / f"run{seed}.csv", seed) for seed in (1, 2))
    _, told = study_from_logs(tmp_path / "study", Logs(logs, str(tmp_path / "platform.toml")))
    form = "predicted along the measured motion: z drive the model, w, q are simulated"
    assert any(remark.startswith(form) and 'prediction = "free"' in remark for remark in told)


def _log(path: Path, seed: int) -> Path:
    draw = np.random.default_rng(seed)
    u = np.cumsum(draw.normal(size=1500)) * 1e-4
    z = w = q = 0.0
    rows = []
    for k, at in enumerate(u):
        a = 40 * (q - z) - 2 * w
        rows.append(f"{0.01 * k:.2f},{at:.6g},{z + 1e-6 * draw.normal():.6g},{a:.6g}")
        w, q = w + 0.01 * a, q + 0.05 * (at - q)
        z += 0.01 * w
    path.write_text("\n".join(["time_s,u [m],z [m],a [m/s^2]", *rows]) + "\n")
    return path
