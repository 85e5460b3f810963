"""Commissioning, model files, friction filter, limits, and the measured EMPS."""

import os
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.io import loadmat
from scipy.stats import chi2

from monitor.commissioning.commission import commission
from monitor.commissioning.friction_filter import fit_friction_filter
from monitor.decision.decision_rules import chance_a_look, rules_for
from monitor.model import (
    EquationsPlant,
    FrictionSection,
    HealthyLimits,
    NoiseSection,
    RangeSection,
    RemainderSection,
    model_versions,
)
from monitor.model.model_file import RigModel, load_model, model_text
from monitor.pipeline.pipeline import Monitor
from monitor.signals.inertia import commission_inertia, kernels
from monitor.signals.recordings import Recording, recording_of
from rigwatch.physics.transfer.transfer_function import TransferFunction
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.messages.message_types import Column, SampleBlock
from tests.monitor.monitor_rig import RATE, SINE, friction, model, run


def saved(found: RigModel, folder: Path) -> Path:
    path = folder / "model.toml"
    path.write_text(model_text(found), encoding="utf-8")
    return path


def test_a_model_file_read_back_is_the_same(tmp_path: Path) -> None:
    assert load_model(saved(model(), tmp_path)) == model()


def test_commissioning_finds_the_rig() -> None:
    found = model()
    assert found.velocity.sensor_corner == pytest.approx(0.5, abs=0.1)
    assert found.noise.residual == pytest.approx(0.03, rel=0.2)
    assert found.friction.explained > 0.99
    assert found.signature[1] < 1.0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("hop = 1", "hopp = 1", "hop"),
        ("hop = 1", "hop = 0", "window.hop"),
        ('"acceleration"]', '"acceleration", "more"]', "channels"),
        ("a = [1.0, -", "a = [1.0, -9", "stable"),
    ],
)
def test_a_wrong_model_file_is_reported(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = saved(model(), tmp_path)
    path.write_text(path.read_text().replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=says):
        load_model(path)


def of_equations() -> RigModel:
    return RigModel(
        sample_rate=RATE,
        channels=("drive", "place", "acceleration"),
        plant=EquationsPlant(model="mass-spring-damper", names=("m",), values=(0.5,), port="force"),
        friction=FrictionSection(b=(1.0,), a=(1.0,), gamma=0.0),
        noise=NoiseSection(residual=0.1),
        remainder=RemainderSection(
            centre=(0.0, 0.0), scale=(1.0, 1.0), weights=(0.1, 0.2, 0.3, 0.4, 0.5)
        ),
        motion_range=RangeSection(names=("drive", "v"), low=(-3.0, -4.0), high=(3.0, 4.0)),
        healthy=HealthyLimits(
            noise=0.1, growth=(0.1,), short=1.0, medium=1.0, friction=1.0, sensor_noise=0.1,
            sensor_growth=0.1, sensor=1.0, speed_noise=1e-3,
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[0.1, 0.2, 0.3, 0.4, 0.5]", "[0.1, 0.2, 0.3, 0.4]", r"remainder\.weights.*4.*5"),
        ("scale = [1.0, 1.0]", "scale = [1.0]", r"remainder\.scale.*1.*2"),
        ("low = [-3.0, -4.0]", "low = [-3.0]", r"motion_range\.low.*1.*2"),
        ("high = [3.0, 4.0]", "high = [3.0, 4.0, 5.0]", r"motion_range\.high.*3.*2"),
    ],
)
def test_values_that_are_missing_from_a_model_of_equations_are_reported(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    path = saved(of_equations(), tmp_path)
    assert load_model(path) == of_equations()
    path.write_text(path.read_text().replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=says):
        load_model(path)


STEADY = {
    "paces": (8.0, 4.0), "sizes": (1.0, 2.0), "narrow": (1.5, 1.2), "energies": (1.1, 1.2),
    "drives": (0.4, 0.2), "shorts": (2.0, 2.1), "mediums": (1.5, 1.6), "frictions": (3.0, 3.1),
    "onsets": (2.5, 2.6), "motion_bands": (0.1,) * 14, "skews": (np.nan,) * 6,
    "drive_energies": (0.1,) * 21,
}  # fmt: skip


def with_steady(**figures: tuple[float, ...]) -> RigModel:
    """The model with figures of steady motions; a model of equations has no others."""
    found, named = of_equations(), {f"steady_{key}": own for key, own in figures.items()}
    assert found.healthy is not None
    return structs.replace(found, healthy=structs.replace(found.healthy, **named))


def test_figures_of_steady_motions_are_read_back(tmp_path: Path) -> None:
    earlier = {key: STEADY[key] for key in ("paces", "sizes", "narrow", "energies")}
    for known in (STEADY, earlier):
        again = load_model(saved(with_steady(**known), tmp_path))
        assert again.healthy is not None
        assert again.healthy.steady_sizes == (1.0, 2.0)


@pytest.mark.parametrize("key", STEADY)
@pytest.mark.parametrize("value", [None, np.inf, -np.inf])
def test_a_figure_of_a_steady_motion_that_is_missing_or_infinite_is_reported(
    tmp_path: Path, key: str, value: float | None
) -> None:
    rest = STEADY[key][:-1] if value is None else (*STEADY[key][:-1], value)
    with pytest.raises(ConfigError, match=r"healthy\.steady_"):
        load_model(saved(with_steady(**STEADY | {key: rest}), tmp_path))


@pytest.mark.parametrize("key", ["sizes", "narrow", "energies"])
def test_a_steady_motion_has_the_figures_of_every_version(tmp_path: Path, key: str) -> None:
    with pytest.raises(ConfigError, match=rf"healthy\.steady_{key}"):
        load_model(saved(with_steady(**STEADY | {key: ()}), tmp_path))


def test_a_line_of_the_history_that_a_kill_has_torn_takes_no_later_one_with_it(
    tmp_path: Path,
) -> None:
    path, author = tmp_path / "model.toml", model_versions.Author("ann", "why")
    model_versions.install(path, "first", 1, author)
    with (tmp_path / "model.history.jsonl").open("ab") as lines:
        lines.write(b'{"t_ns": 2, "step": "prom')
    model_versions.install(path, "second", 3, author)
    model_versions.roll_back(path, 4, author)
    assert [line.t_ns for line in model_versions.history(path)] == [1, 3, 4]


def test_a_change_that_the_history_cannot_take_changes_nothing(tmp_path: Path) -> None:
    path, author = tmp_path / "model.toml", model_versions.Author("ann", "why")
    path.write_text("now", encoding="utf-8")
    (tmp_path / "model.v1.toml").write_text("before", encoding="utf-8")
    (tmp_path / "model.history.jsonl").mkdir()
    with pytest.raises(ConfigError):
        model_versions.install(path, "new", 1, author)
    with pytest.raises(ConfigError):
        model_versions.roll_back(path, 2, author)
    kept = {file.name: file.read_text() for file in tmp_path.glob("*.toml")}
    assert kept == {"model.toml": "now", "model.v1.toml": "before"}


def test_a_missing_recording_is_reported() -> None:
    healthy = recording_of("healthy", "healthy", RATE, run(SINE, 8.0))
    with pytest.raises(ModelError, match="no chirp recording"):
        commission([healthy])


def test_a_friction_recording_without_friction_is_reported() -> None:
    parts = [
        recording_of("chirp", "chirp", RATE, run(SINE, 40.0)),
        recording_of("healthy", "healthy", RATE, run(SINE, 10.0)),
        recording_of("friction", "calm", RATE, run(SINE, 10.0)),
    ]
    with pytest.raises(ModelError):
        commission(parts)


def test_the_friction_filter_is_found_with_its_signature() -> None:
    true = TransferFunction.of([-1.0, 1.8, -0.8], [1.0, -1.8, 0.803])
    t = np.arange(1200)
    v = 0.5 * np.sin(0.196 * t) + 0.1 * np.sin(0.05 * t)
    y = true.simulate(np.sign(v) + 1.2 * v)
    y = y + 0.002 * np.random.default_rng(5).standard_normal(t.size)
    found = fit_friction_filter(v, y, skip=0, gammas=np.arange(0.0, 2.6, 0.2))
    assert found.gamma == pytest.approx(1.2, abs=0.21)
    assert found.explained > 0.999


def test_known_friction_of_another_level_scales_the_estimate() -> None:
    weak = recording_of("friction", "weak", RATE, run(SINE, 16.0, friction(10.0, 0.2), seed=31))
    strong = recording_of("friction", "known", RATE, run(SINE, 16.0, friction(10.0), seed=13))
    assert weak.sha256 != strong.sha256


def test_the_factor_keeps_the_chance_it_promises() -> None:
    rules = rules_for(model())
    chance = chance_a_look(model().decision.false_alarm, model().sample_rate)
    assert np.exp(-(rules.factor**2) / 2.0) == pytest.approx(chance, rel=1e-6)
    assert chi2.sf(rules.limit_64, 64) == pytest.approx(chance, rel=1e-3)


def test_kernels_differentiate_parabolas_exactly() -> None:
    w, first, second = kernels(20, 1000.0)
    time = -np.arange(-20, 21) / 1000.0
    assert w.sum() == pytest.approx(1.0)
    assert first @ (2.0 * time) == pytest.approx(2.0)
    assert second @ (3.0 * time**2 + time + 7.0) == pytest.approx(6.0, rel=1e-6)


def measured(name: str) -> Recording:
    folder = os.environ.get("RIGWATCH_DATA", "")
    if not folder:
        if os.environ.get("CI"):
            pytest.fail("RIGWATCH_DATA is not set: it names the folder with the measured data")
        pytest.skip("RIGWATCH_DATA is not set")
    data = loadmat(Path(folder) / "emps" / name)
    force = float(np.ravel(data["gtau"])[0]) * data["vir"].ravel()
    return recording_of("healthy", name, 1000.0, {"force": force, "position": data["qm"].ravel()})


def test_emps_estimates_settle_at_the_published_friction() -> None:
    """Published: 20.39 N Coulomb, 203.5 N/(m/s) viscous, 95.11 kg (Janot, Gautier, Brunot 2019)."""
    recording = measured("DATA_EMPS.mat")
    found = commission_inertia([recording])
    assert found.plant.mass == pytest.approx(95.11, rel=0.01)  # type: ignore[union-attr]
    at = np.arange(recording.channel("force").size, dtype=np.int64)
    columns = tuple(
        Column(name, unit, recording.channel(name))
        for name, unit in (("force", "N"), ("position", "m"))
    )
    block = SampleBlock("emps", 1, 0, at * 1000, at * 1_000_000, columns)
    result = Monitor(found).update(block)
    assert result is not None
    for name, published in (("theta1", 20.39), ("theta2", 203.5)):
        settled = result.estimates.column(name).values[8000:]
        assert np.max(np.abs(settled / published - 1.0)) < 0.05
    departure = next(c for c in result.conditions if c.name == "departure")
    assert not departure.active.any()
