"""An accepted model goes to a running monitor: its residual falls, nothing is lost, and back."""

import json
import os
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.model.model_file import PromotedSection, load_model, model_text, parse_model
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.process.loop import MonitorProcess, suitable_model
from rigwatch.commands import main
from rigwatch.replay.run import judge
from rigwatch.replay.source import items
from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import ModelReply, ModelRequest, ask_for_model
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.messages.blocks import concatenate, cut, pieces
from rigwatch.wire.messages.message_types import EstimateBlock, ModelChange, SampleBlock
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.messages.topics import ESTIMATES, MODELS, SAMPLES
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import SessionWriter, open_session, run_info
from rigwatch.workbench.steps.promotion import promotion
from rigwatch.workbench.study.study import Study, open_study
from tests.report.drive import COULOMB, MASS, MODEL, PUSH, RATE, VISCOUS, block, make_study

RIG = """
[rig]
id = "drive"
sample_rate = 500.0
[bus]
router = "tcp/127.0.0.1:9"
listen = "tcp/127.0.0.1:9"
[[channels]]
name = "force"
unit = "N"
gain = 0.001
[[channels]]
name = "position"
unit = "m"
gain = 0.001
[daq.device]
adapter = "serial"
port = "/dev/null"
[monitor]
model = "{model}"
"""
SETTLED = 600
"""Samples after which the estimates stand again."""


class Bench:
    """A monitor whose loop is turned by hand."""

    def __init__(self, folder: Path) -> None:
        self.model = folder / "model.toml"
        self.model.write_text(model_text(MODEL))
        self.path = folder / "rig.toml"
        self.path.write_text(RIG.format(model=self.model))
        network = MemoryNetwork()
        config = load_rig(self.path)
        self.daq = network.bus("drive", "daq")
        self.observer = network.bus("drive", "observer", signer_of(config.bus.security, ""))
        self.estimates = self.observer.subscribe(ESTIMATES)
        self.changes = self.observer.subscribe(MODELS)
        self.monitor = MonitorProcess(
            config, self.path, suitable_model(config, self.path), network.bus("drive", "monitor")
        )

    def send(self, samples: SampleBlock) -> None:
        for piece in pieces(samples, 7):
            self.daq.publish(SAMPLES, piece)
            self.turn()

    def turn(self) -> None:
        for item in self.monitor.reader.read(0.0):
            self.monitor.take(item)
        self.monitor.keep_position()
        self.monitor.look_around()

    def ask(self, change: ModelRequest) -> ModelReply:
        """Ask from a thread of its own, as an operator does, while the loop turns."""
        answers: list[ModelReply] = []
        asking = threading.Thread(
            target=lambda: answers.append(ask_for_model(self.observer, change))
        )
        asking.start()
        while asking.is_alive():
            self.turn()
        return answers[0]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.monitor.close()


def change_of(study: Study) -> ModelRequest:
    return ModelRequest("promote", promotion(study, MODEL).text, "ann", "friction is known")


def rms(estimates: EstimateBlock, first: int, last: int) -> float:
    residual = estimates.column("residual").values[first:last]
    return float(np.sqrt(np.nanmean(residual**2)))


def test_the_monitor_gets_what_the_study_has_learnt(study: Study) -> None:
    found = promotion(study, MODEL)
    assert found.learnt["mass"] == pytest.approx(MASS, rel=0.02)
    assert found.learnt["coulomb"] == pytest.approx(COULOMB, rel=0.02)
    assert found.learnt["viscous"] == pytest.approx(VISCOUS, rel=0.02)
    assert found.learnt["offset"] == pytest.approx(PUSH, rel=0.02)
    assert found.after < 0.1 * found.before
    assert parse_model(found.text, "promoted") == found.model
    assert MODEL.band is not None
    assert found.model.band is not None
    assert found.model.band.low[0] == pytest.approx(MODEL.band.low[0] - found.learnt["coulomb"])


def test_the_residual_of_a_running_monitor_falls_and_rises_again(
    study: Study, bench: Bench
) -> None:
    samples = block(3)
    bench.send(cut(samples, 0, 2000))
    reply = bench.ask(change_of(study))
    assert reply.done, reply.text
    assert reply.seq == 2000
    bench.send(cut(samples, 2000, 4000))
    assert load_model(bench.model).promoted is not None
    assert bench.ask(ModelRequest("rollback", "", "ann", "")).done
    bench.send(cut(samples, 4000, 6000))
    whole = concatenate(bench.estimates.drain())
    assert len(whole) == 6000
    before, during = rms(whole, SETTLED, 2000), rms(whole, 2000, 4000)
    assert during < 0.1 * before
    assert rms(whole, 4000, 6000) == pytest.approx(before, rel=0.3)
    # Estimated is friction beyond what is known: all of it, none, all of it.
    theta = whole.column("theta1").values
    assert np.nanmedian(theta[1500:2000]) == pytest.approx(COULOMB, rel=0.1)
    assert abs(np.nanmedian(theta[3500:4000])) < 0.1 * COULOMB
    assert load_model(bench.model) == MODEL
    assert [c.seq for c in bench.changes.drain()] == [2000, 4000]


def test_a_replay_gives_the_same_to_the_last_bit(
    study: Study, bench: Bench, tmp_path: Path
) -> None:
    samples = block(3, 3000)
    bench.send(cut(samples, 0, 1501))
    assert bench.ask(change_of(study)).done
    bench.send(cut(samples, 1501, 3000))
    live = concatenate(bench.estimates.drain())
    path = tmp_path / "session.mcap"
    with SessionWriter(path, run_info("drive", RATE), sync=False) as writer:
        for message in (samples, *bench.changes.drain()):
            writer.write(message)
    session = open_session(path)
    judged = list(judge(session, RigMonitor(MODEL), items(session)))
    assert sum(isinstance(j.item, ModelChange) for j in judged) == 1
    replayed = concatenate([j.watched.estimates for j in judged if j.watched])
    assert encode(replayed) == encode(live)


def test_a_change_that_a_slow_disk_delays_is_answered_by_what_becomes_of_it(
    study: Study, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    sync = os.fsync

    def slowly(handle: int) -> None:
        time.sleep(2.0)  # two files: longer than a change may wait for its turn
        sync(handle)

    bench.send(cut(block(3), 0, 500))
    monkeypatch.setattr(os, "fsync", slowly)
    reply = bench.ask(change_of(study))
    assert reply.done, reply.text
    assert reply.seq == 500
    assert load_model(bench.model).promoted is not None


def test_a_change_that_is_answered_busy_changes_nothing(study: Study, bench: Bench) -> None:
    reply = ask_for_model(bench.observer, change_of(study))  # while the loop does not turn
    assert not reply.done
    assert "busy; nothing changes" in reply.text
    bench.turn()
    assert load_model(bench.model) == MODEL == bench.monitor.rig.model


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (ModelRequest("rollback", "", "ann", ""), "no version before"),
        (ModelRequest("promote", "mass = 1", "ann", ""), "the new model"),
        (
            ModelRequest("promote", model_text(structs.replace(MODEL, sample_rate=256.0)), "a", ""),
            "rate",
        ),
    ],
)
def test_what_does_not_suit_is_refused_and_nothing_changes(
    bench: Bench, change: ModelRequest, words: str
) -> None:
    reply = bench.ask(change)
    assert not reply.done
    assert words in reply.text
    assert load_model(bench.model) == MODEL == bench.monitor.rig.model
    assert not bench.changes.drain()


def test_without_a_monitor_the_file_is_changed_and_rolled_back(
    study: Study, bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["study", "promote", str(study.folder), "--rig", str(bench.path), "--json"]
    assert main(arguments) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["live"] is False
    assert said["residual"]["after"] < 0.1 * said["residual"]["before"]
    assert load_model(bench.model).promoted is not None
    assert load_model(bench.model.with_name("model.v1.toml")) == MODEL
    assert main([*arguments, "--rollback"]) == 0
    assert load_model(bench.model) == MODEL
    history = bench.model.with_name("model.history.jsonl").read_text().splitlines()
    assert [json.loads(line)["step"] for line in history] == ["promote", "rollback"]
    assert main([*arguments, "--rollback"]) == 2


def test_a_study_without_effects_has_nothing_to_promote(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no accepted effect"):
        promotion(make_study(tmp_path), MODEL)


def test_friction_by_direction_needs_an_inertia() -> None:
    transfer = Path(__file__).parents[1] / "verify" / "model.toml"
    section = PromotedSection(viscous_by_direction=1.0)
    with pytest.raises(ConfigError, match="direction"):
        parse_model(model_text(structs.replace(load_model(transfer), promoted=section)), "model")


def test_blocks_do_not_matter_where_friction_is_promoted() -> None:
    section = PromotedSection(coulomb=12.0, viscous=60.0, viscous_by_direction=3.0)
    model, samples = structs.replace(MODEL, promoted=section), block(4, 2000)
    whole = RigMonitor(model).update(samples)
    one = RigMonitor(model)
    parts = [one.update(piece) for piece in pieces(replace(samples), 13)]
    assert whole is not None
    assert encode(concatenate([p.estimates for p in parts if p])) == encode(whole.estimates)


def test_on_a_rig_with_a_transfer_function_friction_goes_through_its_filter(tmp_path: Path) -> None:
    recordings = Path(__file__).parents[1] / "verify"
    (tmp_path / "study.toml").write_text(
        f"""
        model = "mass-spring-damper"
        channels = {{ force = "voltage" }}
        [[train]]
        session = "{recordings / "friction.mcap"}"
        start = 4.0
        end = 6.0
        [[held_out]]
        session = "{recordings / "friction.mcap"}"
        start = 6.0
        [[effects]]
        effect = "coulomb"
        port = "load"
        parameters = {{}}
        """
    )
    found = promotion(open_study(tmp_path), load_model(recordings / "model.toml"))
    assert found.model.promoted is not None
    assert found.model.promoted.coulomb == pytest.approx(0.8, abs=0.1)
    assert found.after < 0.2 * found.before
