"""An alarm is followed by what is probably missing, ranked without making samples wait."""

import re
import tempfile
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.diagnosis.background_ranking import Explainer
from monitor.diagnosis.fault_candidates import Suspect, in_words, suspects
from monitor.diagnosis.observed_change import Evidence
from monitor.diagnosis.ranking_job import ask
from monitor.model.model_file import RigModel, load_model
from monitor.pipeline.pipeline import Monitor
from monitor.pipeline.rig_monitor import RigMonitor
from rigwatch.physics.engine.equations.effect import Effect, EffectParameter
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.simulated import simulate
from rigwatch.wire.messages.blocks import concatenate, pieces
from rigwatch.wire.messages.message_types import Alarm, Event, SampleBlock
from rigwatch.wire.session import open_session
from sim_plant.excitation import Sine
from sim_plant.scenario import Event as Fault
from sim_plant.scenario import load_scenario
from tests.monitor import observed_rig
from tests.monitor.observed_rig import coulomb
from tests.report.drive import COULOMB, VISCOUS, block
from tests.report.drive import MODEL as INERTIA
from tests.waiting import eventually

RECORDINGS = Path(__file__).parents[1] / "verify"
SCENARIOS = Path(__file__).parents[2] / "configs" / "scenarios"
RIG = load_model(RECORDINGS / "model.toml")
ONSET, SECONDS, RATE = 5.0, 7.5, 256


def evidence(effect: str = "", value: float = 0.0, seed: int = 3) -> Evidence:
    """The simulated rig with a fault from ONSET on, as the monitor judges it; to be changed."""
    return deepcopy(_evidence(effect, value, seed))


@cache
def _evidence(effect: str, value: float, seed: int) -> Evidence:
    healthy = load_scenario(SCENARIOS / "experiment_2.toml").healthy(SECONDS)
    faults = (Fault(at_s=ONSET, effect=effect, value=value),) if effect else ()
    samples = concatenate(list(simulate(structs.replace(healthy, events=faults), seed=seed)))
    return _judged(RIG, samples, round(ONSET * RATE))


def _judged(model: RigModel, samples: SampleBlock, onset: int) -> Evidence:
    result = Monitor(model).update(samples)
    assert result is not None
    signals = np.stack([samples.channel(name).values for name in model.channels], axis=1)
    return Evidence(signals, result.estimates.column("change").values, onset)


def top_class(rows: list[Suspect]) -> set[str]:
    return {rows[0].label, *rows[0].alike}


FAULTS = [
    ("coulomb", 0.3, "coulomb@load", 3),
    ("viscous", 1.5, "viscous@load", 8),
    ("spring", 100.0, "linear_stiffness@load", 3),
    ("actuator_gain", 0.85, "gain@drive", 8),
    ("actuator_deadband", 0.15, "dead_band@drive", 8),
    ("acceleration_gain", 0.85, "gain@acceleration_sensor", 8),
    ("acceleration_bias", 1.5, "offset@acceleration_sensor", 4),
    ("acceleration_lag", 0.006, "lag@acceleration_sensor", 5),
    ("chamber_leak", 0.02, "leakage@chambers", 8),
]
BY_DAY = {"coulomb", "spring", "actuator_gain", "acceleration_lag", "chamber_leak"}


@pytest.mark.parametrize(
    ("effect", "value", "name", "most"),
    [
        # By day one of each kind of port.
        pytest.param(*fault, id=fault[0], marks=() if fault[0] in BY_DAY else pytest.mark.nightly)
        for fault in FAULTS
    ],
)
def test_the_fault_stands_in_the_first_class(
    effect: str, value: float, name: str, most: int
) -> None:
    rows = suspects(evidence(effect, value), RIG, library())
    assert name in top_class(rows)
    assert len(top_class(rows)) <= most
    assert rows[0].p_value < 1e-6


def test_a_healthy_rig_leaves_nothing_to_be_named() -> None:
    assert "cannot tell" in in_words(suspects(evidence(), RIG, library()))


@pytest.mark.parametrize(
    ("p_value", "words"),
    [
        (1e-9, "by chance less than once in a million"),
        (0.0043, "by chance about once in 230"),
        (1.0, "by chance more often than not"),
    ],
)
def test_a_probability_is_told_as_once_in_so_many(p_value: float, words: str) -> None:
    row = Suspect("coulomb", "load", p_value, 0.99, 1, physics="Dry surfaces resist.")
    text = in_words([row])
    share = "explains 99% of the change since healthy"
    assert f"coulomb@load (dry surfaces resist): {share}, {words}" in text
    assert ("cannot tell" in text) == (p_value > 0.01)


def test_rivals_of_one_family_leave_the_kind_of_fault_without_doubt() -> None:
    best = Suspect("coulomb", "load", 1e-9, 0.99, 1, "dry friction")
    law = Suspect("bliman_sorine_2", "load", 1e-9, 0.99, 3, "dry friction")
    leak = Suspect("leakage", "chambers", 1e-9, 0.99, 1, "leak")
    elsewhere = replace(law, port="valve")
    settled = in_words([replace(best, alike=(law.label,)), law])
    assert "dry friction at load is settled, by which law is not: bliman_sorine_2@load" in settled
    assert "bliman_sorine_2@load, another law of it, explains as much" in settled
    assert "cannot be told" not in settled
    for other in (leak, elsewhere):
        both = replace(best, alike=(law.label, other.label))
        assert f"{law.label}, {other.label} explain as much in this motion, so check" in in_words(
            [both, law, other]
        )
    told = replace(law, physics="Friction follows with two lags.")
    assert "by which law is not: bliman_sorine_2@load (friction follows with two lags), an" in (
        in_words([replace(best, alike=(law.label,)), told])
    )
    many = [replace(told, effect=name) for name in ("dahl", "lugre", "jenkins")]
    listed = in_words([replace(best, alike=tuple(row.label for row in many)), *many])
    assert "dahl@load, lugre@load, jenkins@load, other laws of it, explain" in listed
    nameless = replace(law, family="")
    alone = replace(best, family="", alike=(law.label,))
    assert "so check these too" in in_words([alone, nameless]), "no family is none in common"


def test_what_no_effect_explains_is_not_given_a_name() -> None:
    healthy = evidence()
    time_ = np.arange(len(healthy.change)) / RATE
    strange = healthy.change + 2.0 * np.sin(2 * np.pi * 13.7 * time_)
    text = in_words(suspects(replace(healthy, change=strange), RIG, library()))
    assert "cannot tell" in text or "no known effect" in text


def test_samples_without_a_residual_do_not_count() -> None:
    holed = evidence("coulomb", 0.3)
    holed.change[1500:1600] = np.nan
    holed.signals[1500:1600] = np.nan
    assert suspects(holed, RIG, library())[0].label == "coulomb@load"


def test_too_few_samples_are_not_judged() -> None:
    holed = evidence("coulomb", 0.3)
    holed.change[1400:] = np.nan
    assert "cannot tell" in in_words(suspects(holed, RIG, library()))


def test_an_effect_of_the_users_own_is_ranked_beside_ours() -> None:
    own = Effect(
        port="force",
        expression="-b*v**3",
        physics="Drag with the third power of speed.",
        source="a test",
        parameters={"b": EffectParameter(unit="{F}/({v}*{v}*{v})", role="strength", low=0.0)},
    )
    rows = suspects(evidence("viscous", 1.5), RIG, {"cubic_drag": own})
    assert rows[0].label == "cubic_drag@load"


def test_an_inertia_is_ranked_beyond_its_healthy_friction() -> None:
    samples = block(3, 4000)
    force, position = (samples.channel(name).values for name in ("force", "position"))
    extra = np.where(np.arange(4000) < 1500, 0.0, 9.0)
    pushed = replace(samples.channels[0], values=force + extra)
    # Its band has friction in the middle, at what the drive has.
    assert INERTIA.band is not None
    assert np.mean([INERTIA.band.low, INERTIA.band.high], axis=0) == pytest.approx(
        [COULOMB, VISCOUS]
    )
    plant = structs.replace(INERTIA.plant, mass=20.0, offset=3.0)
    model = structs.replace(INERTIA, plant=plant)
    found = _judged(model, replace(samples, channels=(pushed, samples.channels[1])), 1500)
    assert np.ptp(position) > 0.1
    rows = suspects(found, model, library())
    assert top_class(rows) & {"constant_force@load", "offset@force_sensor", "offset@drive"}
    assert rows[0].explained > 0.9


def test_a_file_of_effects_that_does_not_fit_is_reported_and_no_room_on_a_disk_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong, full = tmp_path / "mine.toml", tmp_path / "full"
    wrong.write_text("[effects.mine]\n")
    monkeypatch.setattr(tempfile, "tempdir", str(full))
    monkeypatch.setenv("TMPDIR", str(full))
    found = evidence("coulomb", 0.3)
    text = ask(found.signals, found.change, found.onset, RIG, [str(wrong)])
    assert text.startswith("probably missing: cannot tell")
    assert "mine.toml" in text
    assert not full.exists()


def ranked(model: RigModel, blocks: Iterable[SampleBlock]) -> tuple[str, list[Alarm]]:
    """What is told after the first alarm of a run, and the alarms that then stand."""
    monitor, explainer = RigMonitor(model), Explainer(lambda: model)
    for piece in blocks:
        watched = monitor.update(piece)
        assert watched is not None
        explainer.take(watched.estimates, piece)
        for said in watched.announcements:
            if isinstance(said, Alarm):
                explainer.hear(said)
    found: list[Event] = []

    def explained() -> bool:
        found.extend(explainer.results())
        return bool(found)

    eventually(explained, "the change is explained")
    assert len(found) == 1
    assert found[0].code == "PROBABLY MISSING"
    return found[0].text, explainer.with_causes(monitor.alarms.standing())


def test_friction_on_the_simulated_rig_is_named_after_its_alarm() -> None:
    recording = open_session(RECORDINGS / "friction.mcap")
    blocks = (piece for whole in recording.samples() for piece in pieces(whole, 16))
    text, standing = ranked(RIG, blocks)
    plain = "(dry surfaces resist sliding with a force that does not depend on speed)"
    assert f"probably missing: coulomb@load {plain}: explains " in text
    assert "of the change since healthy, by chance less than once in a million" in text
    assert any("probably missing: coulomb@load" in alarm.cause for alarm in standing)


@pytest.mark.parametrize("force", [0.2, 0.5])
def test_its_force_is_told_again_after_whole_periods(force: float) -> None:
    slow = observed_rig.run(Sine(amplitude=1.0, frequency=4.0), 8.0, coulomb(5.0, force), seed=44)
    text, _ = ranked(observed_rig.model(), pieces(observed_rig.block(slow), 16))
    told = re.search(r"; the friction is ([\d.]+) N by now$", text)
    assert told is not None
    assert float(told[1]) == pytest.approx(force, rel=0.1)
