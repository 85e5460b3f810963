"""What a killed process has sent is answered for by its next run: to the last message, or not."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigwatch.wire.bus import kept_messages
from rigwatch.wire.bus.kept_messages import KeptMessages
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.tokens.watching import _Token
from rigwatch.wire.messages import ALARMS, Gap
from rigwatch.wire.ordering import (
    EMPTY,
    OPEN,
    UNKNOWN,
    Ask,
    Numbered,
    PastRun,
    PastRuns,
    SampleOrder,
)
from tests.bus.test_complete_subscription import heard, say
from tests.waiting import eventually

HALF = 2048


def killed(path: Path, run: int, payloads: list[bytes], half: int = HALF) -> KeptMessages:
    """A run that has sent messages and was killed; what it had found of earlier ones."""
    kept = KeptMessages(path, half)
    kept.begin(run)
    for number, payload in enumerate(payloads):
        kept.write(Numbered(run, number, payload))
    return kept


def left(path: Path, run: int, half: int = HALF) -> tuple[dict[int, bytes], int, list[int]]:
    """What the next run answers for one: messages, what is said of its end, and the run behind."""
    past, found, first = KeptMessages(path, half).past, dict[int, bytes](), 0
    while True:
        reply = past.reply(Ask(run, first, OPEN))
        own = {one.seq: one.payload for one in reply.blocks if one.boot == run}
        if not own:
            return found, reply.settled, [one.boot for one in reply.blocks]
        found |= own
        first = reply.settled + 1


def test_the_next_run_answers_for_all_runs_before_it_and_names_each_ones_successor(
    tmp_path: Path,
) -> None:
    path = tmp_path / "said"
    killed(path, 11, [b"a", b"b"])
    killed(path, 12, [])
    killed(path, 13, [b"c"])
    assert left(path, 11) == ({0: b"a", 1: b"b"}, 1, [12])
    assert left(path, 12) == ({}, EMPTY, [13])
    assert left(path, 13) == ({0: b"c"}, 0, [])
    assert left(path, 14) == ({}, UNKNOWN, [])


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(st.lists(st.integers(0, 400), max_size=12), min_size=1, max_size=6))
def test_what_is_found_is_the_newest_without_a_hole(
    tmp_path_factory: pytest.TempPathFactory, runs: list[list[int]]
) -> None:
    path = tmp_path_factory.mktemp("said") / "said"
    sent = [bytes([n % 251]) * size for run in runs for n, size in enumerate(run)]
    at = 0
    for number, sizes in enumerate(runs, 1):
        killed(path, number, sent[at : at + len(sizes)])
        at += len(sizes)
    found = []
    for number, sizes in enumerate(runs, 1):
        messages, settled, _ = left(path, number)
        if messages:
            assert list(messages) == list(range(len(sizes) - len(messages), len(sizes)))
            assert settled == len(sizes) - 1
        found += messages.values()
    assert found == sent[len(sent) - len(found) :]
    forgotten = sent[: len(sent) - len(found)]
    if forgotten:
        assert sum(map(len, found)) + 24 * len(found) > HALF / 2


def overwritten(path: Path) -> None:
    """The middle of the last message is something else."""
    content = bytearray(path.read_bytes())
    place = content.rindex(b"newest")
    content[place + 2] ^= 1
    path.write_bytes(content)


def shortened(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:HALF])


def headless(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[content.index(b"rigsaid")] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("damage", [overwritten, shortened, headless, Path.unlink])
def test_of_a_damaged_file_no_end_is_believed(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = tmp_path / "said"
    killed(path, 11, [b"older", b"the newest one"])
    assert left(path, 11)[1] == 1
    damage(path)
    assert left(path, 11)[1] == UNKNOWN
    assert left(path, 11)[1] == UNKNOWN, "nor by those that follow"
    killed(path, 12, [b"goes on"])
    assert left(path, 12) == ({0: b"goes on"}, 0, [])


def test_after_a_restart_of_the_machine_only_an_orderly_end_is_believed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of an earlier start of the machine, whose id the kernel tells."""
    path = tmp_path / "said"
    other = tmp_path / "boot_id"
    other.write_text("another start\n")
    with monkeypatch.context() as before:
        before.setattr(kept_messages, "_BOOT_ID", other)
        killed(path, 11, [b"a"]).close()
        killed(path, 12, [b"b"])
    assert left(path, 11) == ({0: b"a"}, 0, [12])
    assert left(path, 12) == ({0: b"b"}, UNKNOWN, [])


def test_a_file_that_cannot_be_opened_is_tried_again_and_says_nothing_of_what_was_before(
    tmp_path: Path,
) -> None:
    path = tmp_path / "folder" / "said"
    (tmp_path / "folder").write_text("in its way")
    kept = KeptMessages(path, HALF)
    kept.begin(11)
    kept.write(Numbered(11, 0, b"a"))
    (tmp_path / "folder").unlink()
    kept.write(Numbered(11, 1, b"b"))
    assert left(path, 11) == ({0: b"a", 1: b"b"}, 1, [])


def test_a_listener_hears_the_rest_of_runs_that_began_and_ended_unseen(tmp_path: Path) -> None:
    path, network = tmp_path / "said", MemoryNetwork()
    first = network.bus("r", "monitor")
    first.announce(KeptMessages(path))
    listener = network.bus("r", "listener").listen(ALARMS, gaps_in_place=True)
    say(first, range(3))
    assert heard(listener, 2) == [0, 1, 2]
    network.up = False
    say(first, range(3, 5))
    first.close()
    for begin in (5, 8):
        unseen = network.bus("r", "monitor")
        unseen.announce(KeptMessages(path))
        say(unseen, range(begin, begin + 3))
        unseen.close()
    network.up = True
    last = network.bus("r", "monitor")
    last.announce(KeptMessages(path))
    say(last, range(11, 13))
    assert heard(listener, 12) == list(range(3, 13))
    assert listener.lost == 0


def test_where_nothing_is_known_of_an_end_a_gap_is_reported(tmp_path: Path) -> None:
    path, network = tmp_path / "said", MemoryNetwork()
    first = network.bus("r", "monitor")
    first.announce(KeptMessages(path))
    listener = network.bus("r", "listener").listen(ALARMS, gaps_in_place=True)
    say(first, range(1))
    assert heard(listener, 0) == [0]
    first.close()
    path.unlink()
    last = network.bus("r", "monitor")
    last.announce(KeptMessages(path))
    found: list[object] = []
    eventually(lambda: found.extend(listener.drain()) or bool(found), "a gap")  # type: ignore[func-returns-value]
    assert [type(one) for one in found] == [Gap]


def test_a_listener_that_begins_as_a_process_ends_hears_the_next_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The end of a token may come before the listener's watch has its name."""
    network = MemoryNetwork()
    first = network.bus("r", "monitor")
    say(first, range(1))
    listening = network.bus("r", "listener")

    def unanswered(_watch: object, _key: str, token: _Token) -> None:
        token.due = None

    monkeypatch.setattr(listening._names, "_ask", unanswered)
    listener = listening.listen(ALARMS)
    first.close()
    say(network.bus("r", "monitor"), range(1, 3))
    assert heard(listener, 2) == [1, 2]


def test_a_run_that_may_still_live_is_asked_again_and_not_set_back() -> None:
    order: SampleOrder[Numbered] = SampleOrder((11, -1))
    order.on_token(11, 1, alive=True)
    (ask,) = order.on_silence()
    assert isinstance(ask, Ask)
    past = PastRuns([PastRun(11, (), complete=True)], 1000)
    assert order.on_reply(ask, past.reply(ask)) == []
    assert order.position == (11, -1)
