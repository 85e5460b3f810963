"""An alarm as a study: cut at its onset, whatever has been done with the alarm since."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.model import EquationsPlant
from monitor.model.model_file import model_text
from rigwatch.browser.rig import TooSoonError, study_of_alarm
from rigwatch.simulated import EPOCH_NS, simulate, write_session
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm, Column, EstimateBlock
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.session import open_session, run_info
from rigwatch.wire.session.writer import SessionWriter
from rigwatch.workbench.compare import compare
from rigwatch.workbench.study import Study
from tests.bus.rig import ROOT
from tests.monitor import observed_rig

RATE, ONSET = 256, 10 * 256
SCENARIO = ROOT / "configs" / "scenarios" / "friction_stays.toml"
LONG_AGO = EPOCH_NS / 1e9 + 3600


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty seconds of the rig, which begins to rub after ten."""
    made = tmp_path_factory.mktemp("recorded") / "000001.mcap"
    write_session(made, SCENARIO, seconds=30.0)
    return made


@pytest.fixture
def config(tmp_path: Path) -> RigConfig:
    """A rig whose recorder writes beside the studies."""
    text = (ROOT / "configs" / "story.toml").read_text(encoding="utf-8")
    file = tmp_path / "rig.toml"
    file.write_text(text.replace("story/sessions", str(tmp_path / "sessions")), encoding="utf-8")
    return load_rig(file)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of one session."""
    made = tmp_path / "sessions" / "story-20260101T000000Z"
    made.mkdir(parents=True)
    return made


def _alarm(recorded: Path, onset: int = ONSET, after: float = 0.2) -> Alarm:
    """Dry friction, as the monitor raises it some time after its onset."""
    boot = next(open_session(recorded).samples()).boot
    at = onset + round(after * RATE)
    t_ns = EPOCH_NS + round(at / RATE * 1e9)
    return Alarm(
        "dry_friction", "unacknowledged", "error", "dry friction", "", "rig", boot, at, t_ns, 0.07,
        float("-inf"), 0.0, True, "", onset,
    )  # fmt: skip


def _until(recorded: Path, folder: Path, seconds: float, *alarms: Alarm | EstimateBlock) -> None:
    """A recorder's session of the first seconds, with alarms and estimates."""
    end = EPOCH_NS + round(seconds * 1e9)
    with SessionWriter(folder / "000001.mcap", run_info("story", RATE, t_ns=EPOCH_NS)) as writer:
        for block in open_session(recorded).samples(end=end, size=64):
            writer.write(block)
        for alarm in alarms:
            writer.write(alarm)


def _spans(study: Study) -> dict[str, tuple[float, float]]:
    """What each recording of a study spans, in seconds after the onset."""
    onset = EPOCH_NS / 1e9 + ONSET / RATE
    found = {}
    for use, span in (("fault", study.file.train[0]), ("healthy", study.file.healthy[0])):
        times = [b.t_ns for b in open_session(study.folder / span.session).samples()]
        found[use] = (times[0][0] / 1e9 - onset, times[-1][-1] / 1e9 - onset)
    return found


def test_what_was_healthy_ends_at_the_onset_also_after_an_acknowledgement(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    _until(recorded, folder, 30.0)
    raised = _alarm(recorded)
    seen = replace(raised, state="acknowledged", t_ns=raised.t_ns + 15_000_000_000, user="op")
    study = study_of_alarm(tmp_path, config, seen, LONG_AGO)
    spans = _spans(study)
    assert spans["healthy"] == pytest.approx((-5.5, -0.5), abs=0.01)
    assert spans["fault"] == pytest.approx((0.5, 10.5), abs=0.01)
    assert study.file.train[0].end == pytest.approx(4.75, abs=0.01)
    assert study.file.held_out[0].start == pytest.approx(5.25, abs=0.01)
    # The same alarm is the same study, in whatever state it is by now.
    again = study_of_alarm(tmp_path, config, raised, LONG_AGO)
    assert again.folder == study.folder


def test_a_recorder_that_was_restarted_has_the_onset_in_an_older_session(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    later = folder.parent / "story-2"
    later.mkdir()
    blocks = list(simulate(SCENARIO, seed=9, seconds=2.0))
    with SessionWriter(later / "000001.mcap", run_info("story", RATE, t_ns=EPOCH_NS)) as writer:
        for block in blocks:
            writer.write(block)
    _until(recorded, folder, 24.0)
    study = study_of_alarm(tmp_path, config, _alarm(recorded), LONG_AGO)
    assert _spans(study)["healthy"] == pytest.approx((-5.5, -0.5), abs=0.01)


def test_a_fault_that_lasts_is_recorded_first(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    _until(recorded, folder, 14.0)
    with pytest.raises(TooSoonError, match="its recording lasts 7 s more") as soon:
        study_of_alarm(tmp_path, config, _alarm(recorded), EPOCH_NS / 1e9 + 14.5)
    assert soon.value.seconds == pytest.approx(6.5, abs=0.1)
    # Nothing more comes once the recorder has stopped.
    with pytest.raises(
        SessionError, match=r"found 3\.5 s recorded of the fault, expected at least"
    ):
        study_of_alarm(tmp_path, config, _alarm(recorded), LONG_AGO)
    assert not list(tmp_path.glob("*/study.toml"))


def test_a_fault_that_passed_ends_where_its_alarm_cleared(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    raised = _alarm(recorded)
    cleared = replace(raised, state="cleared_unacknowledged", t_ns=raised.t_ns + 7_000_000_000)
    _until(recorded, folder, 30.0, raised, cleared)
    study = study_of_alarm(tmp_path, config, raised, LONG_AGO)
    assert _spans(study)["fault"] == pytest.approx((0.5, 5.7), abs=0.01)


def _verdicts(recorded: Path, *spans: tuple[float, float]) -> EstimateBlock:
    """Thirty seconds of estimates, with friction named between times after the onset [s]."""
    seq = np.arange(30 * RATE)
    after = (seq - ONSET) / RATE
    named = np.any([(after >= begin) & (after < end) for begin, end in spans], axis=0)
    t_ns = EPOCH_NS + np.round(seq / RATE * 1e9).astype(np.int64)
    boot = next(open_session(recorded).samples()).boot
    return EstimateBlock("rig", boot, 0, t_ns, (Column("verdict", "", named * 1.0),))


def test_a_fault_that_passed_ends_as_many_samples_before_on_a_slower_rig(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    slower = 4
    slow = structs.replace(config, rig=structs.replace(config.rig, sample_rate=RATE / slower))
    raised = _alarm(recorded)
    at = replace(raised, seq=raised.seq // slower, onset_seq=raised.onset_seq // slower)
    # The fault lasts for five seconds; 128 quiet samples end it, and 256 more clear its alarm.
    end = raised.t_ns + round((5.0 - 0.2 + 384 * slower / RATE) * 1e9)
    cleared = replace(at, state="cleared_unacknowledged", t_ns=end)
    info = run_info("story", RATE // slower, t_ns=EPOCH_NS)
    with SessionWriter(folder / "000001.mcap", info) as writer:
        for block in open_session(recorded).samples(size=64):
            columns = [
                replace(one, values=one.values[::slower], quality=one.quality[::slower])
                for one in block.channels
            ]
            writer.write(
                replace(
                    block, seq=block.seq // slower, device_us=block.device_us[::slower],
                    t_ns=block.t_ns[::slower], channels=tuple(columns),
                )
            )  # fmt: skip
        writer.write(at)
        writer.write(cleared)
    study = study_of_alarm(tmp_path, slow, at, LONG_AGO)
    assert _spans(study)["fault"] == pytest.approx((0.5, 5.0), abs=0.05)


def test_an_alarm_that_was_acknowledged_ends_with_the_monitors_verdict(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    raised = _alarm(recorded)
    seen = replace(raised, state="acknowledged", t_ns=raised.t_ns + 3_000_000_000, user="op")
    # A verdict that comes back before the alarm would clear has not ended.
    _until(recorded, folder, 30.0, raised, seen, _verdicts(recorded, (0.2, 4.0), (4.5, 7.0)))
    study = study_of_alarm(tmp_path, config, seen, LONG_AGO)
    assert _spans(study)["fault"] == pytest.approx((0.5, 6.5), abs=0.01)


@pytest.mark.parametrize("told_by", ["verdict", "alarm"])
def test_what_was_faulty_shortly_before_is_not_healthy(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path, told_by: str
) -> None:
    raised = _alarm(recorded)
    before = replace(raised, state="cleared_unacknowledged", t_ns=raised.t_ns - 2_200_000_000)
    told = before if told_by == "alarm" else _verdicts(recorded, (-7.0, -3.0), (0.2, 20.0))
    _until(recorded, folder, 30.0, told)
    with pytest.raises(SessionError, match=r"found 3\.0 s recorded between an earlier fault and"):
        study_of_alarm(tmp_path, config, raised, LONG_AGO)


def test_an_onset_that_was_not_recorded_is_told(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    _until(recorded, folder, 9.0)
    with pytest.raises(SessionError, match="found no recording of sample 2560 of rig"):
        study_of_alarm(tmp_path, config, _alarm(recorded), LONG_AGO)
    with pytest.raises(SessionError, match=r"found 3\.\d s recorded before its onset"):
        study_of_alarm(tmp_path, config, _alarm(recorded, onset=4 * RATE, after=1.0), LONG_AGO)
    unfounded = replace(_alarm(recorded), seq=-1, onset_seq=-1)
    with pytest.raises(SessionError, match="found no sample that raised it"):
        study_of_alarm(tmp_path, config, unfounded, LONG_AGO)


def test_the_study_takes_the_equations_that_the_monitor_runs(
    recorded: Path, config: RigConfig, folder: Path, tmp_path: Path
) -> None:
    model = observed_rig.model()
    assert isinstance(model.plant, EquationsPlant)
    file = tmp_path / "observer.toml"
    file.write_text(model_text(model), encoding="utf-8")
    assert config.monitor is not None
    watched = structs.replace(config, monitor=structs.replace(config.monitor, model=str(file)))
    _until(recorded, folder, 24.0)
    study = study_of_alarm(tmp_path, watched, _alarm(recorded), LONG_AGO)
    assert study.file.model == model.plant.model
    assert study.file.start == dict(zip(model.plant.names, model.plant.values, strict=True))
    shown = compare(study)
    assert shown.held_out_error > 2.0 * shown.noise_floor, "friction is not in these equations"
