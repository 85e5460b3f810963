"""A stranger on the bus: what he sends is refused, and the monitor goes on."""

import errno
import os
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.alarms import Occasion
from monitor.process.cursor import Cursor, stored_position
from rigwatch.wire.bus import KEY as MODEL_KEY
from rigwatch.wire.bus import ModelReply, ModelRequest, ask_for_model
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.messages import ALARMS, COMMANDS, ESTIMATES, HEALTH, AlarmCommand, Health
from tests.bus.publisher import wave
from tests.bus.rig import PATIENCE
from tests.monitor_process.test_process import Bench
from tests.waiting import wait_until

YEAR_NS = 365 * 86_400 * 1_000_000_000


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.monitor.close()


def asked(bench: Bench, request: ModelRequest) -> ModelReply:
    """The reply to a model request while the monitor's loop runs."""
    answers: list[ModelReply] = []
    asker = threading.Thread(target=lambda: answers.append(ask_for_model(bench.observer, request)))
    asker.start()

    def answered() -> bool:
        bench.turn()
        return bool(answers)

    assert wait_until(answered, PATIENCE)
    asker.join()
    return answers[0]


@pytest.mark.parametrize("model", [f"sample_rate = {'9' * 5000}", "a = " + "[" * 50_000])
def test_a_model_that_is_a_bomb_is_refused_and_watching_goes_on(bench: Bench, model: str) -> None:
    reply = asked(bench, ModelRequest("promote", model, "eve", "x" * 100_000))
    assert not reply.done
    assert len(reply.text) < 400
    bench.send(wave(0, 64, 7, time.time_ns()))
    bench.turn_until(63)


def test_a_question_that_is_no_request_for_a_model_is_refused_and_counted(bench: Bench) -> None:
    answers = bench.observer.query(MODEL_KEY, b"[" * 50_000, timeout=PATIENCE)
    assert [b"not a model request" in answer for answer in answers] == [True]
    bench.got(HEALTH)
    told: list[Health] = []

    def counted() -> bool:
        bench.turn()
        told.extend(h for h in bench.got(HEALTH) if isinstance(h, Health))
        return any(health.counters["commands_refused"] == 1.0 for health in told)

    assert wait_until(counted, PATIENCE)


def test_a_command_from_the_future_has_the_monitors_time_and_its_user_is_cut(bench: Bench) -> None:
    alarms, stuck = bench.monitor.rig.alarms, "sensor_stuck.position"
    bench.monitor.say(alarms.report(stuck, Occasion(t_ns=time.time_ns()), active=True))
    ahead = time.time_ns() + 50 * YEAR_NS
    command = AlarmCommand(stuck, "acknowledge", "e" * 200_000, ahead)
    bench.observer.publish(COMMANDS, signed(bench.observer, command))
    bench.turn()
    last = bench.got(ALARMS)[-1]
    assert last.state == "acknowledged"  # type: ignore[attr-defined]
    assert abs(last.t_ns - time.time_ns()) < 60e9  # type: ignore[attr-defined]
    assert len(last.user) <= 100  # type: ignore[attr-defined]
    journal = Path(f"{bench.config.monitor.journal}")  # type: ignore[union-attr]
    assert journal.stat().st_size < 20_000


def test_a_poisoned_position_file_is_set_aside_and_watching_goes_on(bench: Bench) -> None:
    began = time.time_ns()
    bench.send(wave(0, 64, 7, began))
    bench.turn_until(63)
    position = Path(f"{bench.config.monitor.journal}.position")  # type: ignore[union-attr]
    bench.kill()
    poisoned = Cursor(position)
    poisoned.write(7, 10**9)
    poisoned.close()
    bench.start()
    bench.got(ESTIMATES)
    for seq in range(64, 1024, 16):
        bench.send(wave(seq, 16, 7, began + seq * 3_906_250))
        bench.turn()
    assert wait_until(lambda: _caught_up(bench, 1023), PATIENCE, 0.001)
    assert position.with_name(f"{position.name}.set-aside").exists()
    bench.got(ESTIMATES)
    for seq in range(1024, 1152, 16):
        bench.send(wave(seq, 16, 7, began + seq * 3_906_250))
    assert wait_until(lambda: _caught_up(bench, 1151), PATIENCE, 0.001)
    assert wait_until(lambda: bool(bench.got(ESTIMATES)), PATIENCE)
    assert Cursor(position).read() == (7, 1151)


def _caught_up(bench: Bench, seq: int) -> bool:
    bench.turn()
    return bench.monitor.reader.position == (7, seq)


def test_a_monitor_killed_while_it_reads_earlier_samples_keeps_its_position(bench: Bench) -> None:
    bench.send(wave(0, 600, 7, 0))
    bench.turn_until(599)
    bench.kill()
    bench.start()
    bench.monitor.keep_position()
    assert bench.monitor.reader.position == (7, -1)
    position = Path(f"{bench.config.monitor.journal}.position")  # type: ignore[union-attr]
    assert Cursor(position).read() == (7, 599)
    bench.send(wave(600, 1, 7, 0))
    bench.turn_until(600)
    assert Cursor(position).read() == (7, 600)


@pytest.mark.parametrize("seq", [2**60, -7])
def test_a_position_that_no_device_reaches_is_none(tmp_path: Path, seq: int) -> None:
    cursor = Cursor(tmp_path / "p")
    cursor.write(7, seq)
    assert cursor.read() is None
    assert (tmp_path / "p.set-aside").exists()


@pytest.mark.parametrize("why", ["removed", "emptied", "full"])
def test_a_position_whose_file_is_gone_is_kept_in_a_new_one(
    why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "state" / "p"
    if why == "full":
        monkeypatch.setattr("os.posix_fallocate", _refuse)
    cursor = Cursor(path)
    monkeypatch.undo()
    cursor.write(7, 11)
    if why == "removed":
        shutil.rmtree(path.parent)
    if why == "emptied":
        os.truncate(path, 0)
        cursor.write(7, 11)  # the kernel ends a process that writes there itself
    cursor.keep()
    assert Cursor(path).read() == (7, 11)
    cursor.write(7, 12)
    assert Cursor(path).read() == (7, 12)


def test_positions_of_many_rigs_are_written_together_and_one_whose_file_is_emptied_again(
    tmp_path: Path,
) -> None:
    paths = [tmp_path / f"p{number}" for number in range(1200)]
    cursors = [Cursor(path) for path in paths]
    os.truncate(paths[7], 0)
    places = [(cursor, 7, 100 + at) for at, cursor in enumerate(cursors)]
    Cursor.write_all(places)
    found = [stored_position(path.read_bytes()) for path in paths]
    assert found == [None if at == 7 else (7, 100 + at) for at in range(1200)]
    cursors[7].keep()
    assert stored_position(paths[7].read_bytes()) == (7, 107)
    for cursor in cursors:
        cursor.close()


def _refuse(*_: object) -> None:
    raise OSError(errno.ENOSPC, "full")
