"""A hostile client sends 200 kinds of message everywhere: nothing ends, nothing is changed."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import DEVICE_KEY, DeviceReply
from rigwatch.wire.bus import KEY as MODEL_KEY
from rigwatch.wire.typed_files import json_value
from tests.access.answer_times import KEYS, asked, questions
from tests.access.attack import Attacked, attacked
from tests.access.rogue import ASKED, KINDS, NAMED, SAID, everything, kinds
from tests.bus.publisher import OTHER
from tests.waiting import eventually

LONGEST_S, ATTEMPTS = 0.1, 3
"""Longest time of an answer; the shortest of the attempts counts, as a machine is busy at times."""
pytestmark = pytest.mark.xdist_group("rogue client")  # two of the tests share a rig


@pytest.mark.nightly
def test_two_hundred_kinds_of_message_change_nothing_without_keys(tmp_path: Path) -> None:
    with attacked(tmp_path, keys=False) as rig:
        rig.attack(list(everything(kinds()))[::7], time.monotonic() + 60.0)
        found = rig.judge()
    assert found.ended == []
    assert found.samples > 0
    assert (found.wrong, found.lost, found.changes) == (0, 0, [])
    assert found.refused >= found.sent["command"] > 0, "each command is counted"
    assert found.dropped >= found.sent["samples"] > 0, "and what is no sample of the rig"
    assert found.foreign >= found.sent["numbered"] > 0, "and no alarm, estimate or model of it"


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attacked]:
    with attacked(tmp_path_factory.mktemp("rig")) as made:
        yield made


@pytest.mark.nightly
def test_two_hundred_kinds_of_message_change_nothing(rig: Attacked) -> None:
    payloads = kinds()
    assert len(set(payloads)) > 0.8 * KINDS
    messages = list(everything(payloads))
    assert len(messages) == KINDS * (len(SAID) + len(NAMED) + len(ASKED))
    # Every seventh: all of them run in `python -m benchmarks rogue_client`.
    rig.attack(messages[::7], time.monotonic() + 60.0)
    rig.knock(10)
    found = rig.judge()
    assert found.ended == []
    assert found.samples > 0
    assert (found.wrong, found.lost, found.changes) == (0, 0, [])
    assert found.refused_connections >= found.connections == 10
    assert found.denied > 0
    assert found.refused >= found.sent["command"] > 0, "each command is counted"


@pytest.mark.nightly
def test_every_queryable_answers_or_refuses_within_100_ms(rig: Attacked) -> None:
    processes = [*rig.processes.values()]
    bus = rig.rig.bus("ack-ann")
    slow = {}
    for key in KEYS:
        ordinary, *hostile = questions(key, rig.model)
        eventually(lambda k=key, q=ordinary: bool(asked(bus, k, q)[1]), f"{key} answers")  # type: ignore[misc]
        for number, question in enumerate((ordinary, *hostile)):
            times = (asked(bus, key, question)[0] for _ in range(ATTEMPTS))
            if all(taken >= LONGEST_S for taken in times):
                slow[key, number] = question
    assert slow == {}
    accepted = asked(bus, DEVICE_KEY, b"")[1]
    assert [json_value(answer, DeviceReply).known for answer in accepted] == [OTHER]
    promoted = asked(bus, MODEL_KEY, next(questions(MODEL_KEY, rig.model)))[1]
    assert [b"in force" in answer for answer in promoted] == [True]
    assert [process.poll() for process in processes] == [None] * len(processes)
