"""Blocks of many rigs out of a joined message, and into one: the same as each by itself."""

from collections import Counter, deque
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rigwatch.wire.bus.several import Received, Source
from rigwatch.wire.bus.several.joint_message import Part, join, split
from rigwatch.wire.bus.several.joint_receiver import JointReceiver, Share
from rigwatch.wire.bus.several.joint_sender import LARGEST
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import Column, EstimateBlock, Form, SampleBlock, encode
from rigwatch.wire.messages.message_types import ColumnTable
from rigwatch.wire.ordering import Numbered
from rigwatch.wire.rows import Batch, Blocks, EstimateRows, JointRows

RIGS = [f"rig{number}" for number in range(30)]
NAMES = (("voltage", "V"), ("position", "m"), ("acceleration", "m/s^2"))
COLUMNS = tuple((f"signal{number}", "m/s^2") for number in range(19))
ROWS_OF_OUTPUT = 23


def boot_of(rig: int) -> int:
    return 1 << 50 | rig


def samples(rig: int, seq: int, n: int, rng: np.random.Generator) -> SampleBlock:
    columns = tuple(
        Column(name, unit, rng.standard_normal(n), np.zeros(n, np.uint8)) for name, unit in NAMES
    )
    device_us, t_ns = rng.integers(0, 1 << 50, (2, n))
    return SampleBlock("rig", boot_of(rig), seq, device_us, t_ns, columns)


def opened(following: int = 0) -> JointRows:
    rows = JointRows(len(RIGS))
    for row, rig in enumerate(RIGS):
        assert rows.name(row, rig)
        open_row(rows, row, following)
    return rows


def open_row(rows: JointRows, row: int, following: int) -> None:
    assert rows.open(RIGS[row], source_of(row), following)


def source_of(row: int) -> Source:
    names = tuple((name, unit, True) for name, unit in NAMES)
    return Source("daq", "rig", boot_of(row), lambda form: form.names == names)


def part_of(block: SampleBlock) -> Part:
    return RIGS[block.boot & 255], b"", encode(block)


def block_in(batch: Batch, place: int) -> SampleBlock:
    n, at = int(batch.samples[place]), int(batch.at[place])
    values = batch.values[batch.values_at[place] :][: 3 * n].reshape(3, n)
    columns = tuple(
        Column(name, unit, row, np.zeros(n, np.uint8))
        for (name, unit), row in zip(NAMES, values, strict=True)
    )
    span = slice(at, at + n)
    boot = boot_of(int(batch.rows[place]))
    first = int(batch.first[place])
    return SampleBlock("rig", boot, first, batch.device_us[span], batch.t_ns[span], columns)


def test_what_follows_is_taken_as_it_was_sent_whatever_the_lengths() -> None:
    rng, rows, following = np.random.default_rng(1), opened(), [0] * len(RIGS)
    for _ in range(40):
        order = rng.permutation(len(RIGS)).tolist()
        blocks = [samples(rig, following[rig], int(rng.integers(1, 13)), rng) for rig in order]
        assert rows.take(join([part_of(one) for one in blocks]), "daq") == []
        (batch,) = rows.taken()
        assert batch.rows.tolist() == order
        for place, one in enumerate(blocks):
            assert encode(block_in(batch, place)) == encode(one) == batch.payload(place)
            following[order[place]] += len(one)


def test_the_lengths_of_a_busy_machine_are_learnt_once_or_twice() -> None:
    rng, rows, learnt = np.random.default_rng(7), JointRows(1), list[int]()
    assert rows.name(0, RIGS[0])
    names = tuple((name, unit, True) for name, unit in NAMES)

    def suits(form: Form) -> bool:
        learnt.append(form.layout.samples)
        return form.names == names

    following = 20_000  # from here on the number takes as many bytes
    assert rows.open(RIGS[0], Source("daq", "rig", boot_of(0), suits), following)
    for n in rng.integers(6, 14, 400).tolist():
        assert rows.take(join([part_of(samples(0, following, n, rng))]), "daq") == []
        following += n
    assert max(Counter(learnt).values()) <= 2, "a row keeps all lengths of a busy machine"


def flagged(block: SampleBlock) -> SampleBlock:
    quality = np.zeros(len(block), np.uint8)
    quality[-1] = 1
    return replace(
        block, channels=(replace(block.channels[0], quality=quality), *block.channels[1:])
    )


def renamed(block: SampleBlock) -> SampleBlock:
    return replace(block, channels=(*block.channels[:2], replace(block.channels[2], unit="m/s^3")))


OTHERS = {
    "a number that is missing": lambda block: replace(block, seq=block.seq + 1),
    "a number that has been": lambda block: replace(block, seq=block.seq - 1),
    "another boot": lambda block: replace(block, boot=block.boot + 256),
    "another device": lambda block: replace(block, device="gir"),
    "a flag": flagged,
    "another unit": renamed,
    "fewer channels": lambda block: replace(block, channels=block.channels[:2]),
}


@pytest.mark.parametrize("what", OTHERS)
def test_anything_else_is_left_and_closes_the_row_until_it_is_opened(what: str) -> None:
    rng, rows = np.random.default_rng(2), opened()
    rows.take(join([part_of(samples(rig, 0, 9, rng)) for rig in range(30)]), "daq")
    blocks = [samples(rig, 9, 9, rng) for rig in range(30)]
    blocks[7] = OTHERS[what](blocks[7])
    assert rows.take(join([part_of(one) for one in blocks]), "daq") == [part_of(blocks[7])]
    after = [samples(rig, 18, 9, rng) for rig in range(30)]
    assert rows.take(join([part_of(one) for one in after]), "daq") == [part_of(after[7])]
    assert not rows.is_open(7)
    open_row(rows, 7, 27)
    again = [samples(rig, 27, 9, rng) for rig in range(30)]
    assert rows.take(join([part_of(one) for one in again]), "daq") == []
    assert [len(batch.rows) for batch in rows.taken()] == [30, 29, 29, 30]


def test_what_comes_from_others_twice_marked_or_of_no_rig_here_is_left() -> None:
    rng, rows = np.random.default_rng(3), opened()
    first, second = samples(0, 0, 9, rng), samples(0, 9, 9, rng)
    one, two = part_of(samples(1, 0, 9, rng)), part_of(samples(2, 0, 9, rng))
    marked, foreign = (two[0], b"mark", two[2]), ("nobody", b"", two[2])
    assert rows.take(join([one]), "stranger") == [one]
    found = rows.take(join([part_of(first), marked, foreign, part_of(second)]), "daq")
    assert found == [marked, foreign, part_of(second)]
    assert [*map(rows.is_open, range(4))] == [False, True, False, True]


def test_bytes_that_are_no_joined_message_are_refused() -> None:
    rng, rows = np.random.default_rng(4), opened()
    whole = join([part_of(samples(rig, 0, 9, rng)) for rig in range(30)])
    for size in (0, 1, 2, 50, len(whole) - 1):
        with pytest.raises(MessageError):
            rows.take(whole[:size], "daq")
    for _ in range(300):
        damaged = bytearray(whole)
        for place in rng.integers(0, 300, 3):
            damaged[place] ^= int(rng.integers(1, 256))
        try:
            expected = split(bytes(damaged))
        except MessageError:
            with pytest.raises(MessageError):
                rows.take(bytes(damaged), "daq")
            continue
        left = rows.take(bytes(damaged), "daq")
        assert all(one in expected for one in left)
        rows.taken()
        rows = opened()


def test_estimates_are_written_as_they_are_one_by_one() -> None:
    rng, rows = np.random.default_rng(5), EstimateRows(len(RIGS), COLUMNS, 64)
    following, numbers = [0] * len(RIGS), [0] * len(RIGS)
    for row, rig in enumerate(RIGS):
        assert rows.begin(row, rig, ("rig" * (row % 3), boot_of(row) * (row % 5)), (7 + row, 0))
    for _ in range(20):
        order = rng.permutation(len(RIGS))[: int(rng.integers(1, 30))]
        counts = rng.integers(1, 64, len(order))
        at = np.cumsum(counts) - counts
        t_ns = rng.integers(0, 1 << 60, int(counts.sum()))
        values = rng.standard_normal(ROWS_OF_OUTPUT * len(t_ns))
        first = np.array([following[rig] for rig in order.tolist()])
        blocks = Blocks(
            order,
            counts,
            first,
            at,
            t_ns.view(np.uint8),
            values.view(np.uint8),
            8 * ROWS_OF_OUTPUT * at,
        )
        messages, places = rows.written(blocks)
        expected: list[Part] = []
        for row, n, begin in zip(order.tolist(), counts.tolist(), at.tolist(), strict=True):
            table = values[ROWS_OF_OUTPUT * begin :][: len(COLUMNS) * n].reshape(-1, n)
            block = EstimateBlock(
                "rig" * (row % 3),
                boot_of(row) * (row % 5),
                following[row],
                t_ns[begin : begin + n],
                ColumnTable(COLUMNS, table),
            )
            payload = encode(block)
            expected.append((RIGS[row], Numbered(7 + row, numbers[row], payload).mark, payload))
            following[row] += n
            numbers[row] += 1
        assert [part for message in messages for part in split(message)] == expected
        assert [messages[m][a:b] for m, a, b in places.tolist()] == [one[2] for one in expected]
        assert max(map(len, messages)) <= LARGEST + 2


def following_of(channel: deque[Received]) -> Received | None:
    return channel.popleft() if channel else None


def test_a_row_takes_nothing_that_would_overtake_what_waits_for_the_reader() -> None:
    rng, channel, alone = np.random.default_rng(6), deque(), deque()
    receiver = JointReceiver(partial(following_of, channel))
    receiver.rows = JointRows(len(RIGS))
    shares: list[Share] = []
    heard: list[list[bytes]] = [[] for _ in range(2)]
    for row in range(2):
        receiver.name(row, RIGS[row])
        into = heard[row]
        share = receiver.add(
            RIGS[row],
            lambda payload, *_, into=into: into.append(payload),
            partial(following_of, alone if not row else deque()),
        )
        shares.append(share)

    def come(seq: int) -> list[bytes]:
        parts = [part_of(samples(row, seq, 9, rng)) for row in range(2)]
        channel.append((join(parts), "daq", b""))
        return [payload for *_, payload in parts]

    def opens(row: int, following: int, read: bool = True) -> bool:
        return receiver.open(shares[row], source_of(row), following, lambda: read)

    first = come(0)
    assert not opens(0, 0)  # nothing has come joined yet
    receiver.distribute()
    assert not opens(0, 9)  # it waits
    for share in shares:
        share.take()
    assert heard == [[first[0]], [first[1]]]
    assert not opens(0, 9, read=False)
    assert opens(0, 9)
    assert opens(1, 9)
    come(9)
    receiver.distribute()
    (batch,) = receiver.rows.taken()
    assert batch.rows.tolist() == [0, 1]
    third = come(18)
    shares[0].take()  # as a token of rig 0 does that comes now
    receiver.distribute()
    (batch,) = receiver.rows.taken()
    assert (batch.rows.tolist(), batch.payload(0)) == ([1], third[1])  # nothing of rig 1 waits
    shares[1].take()
    assert heard == [[first[0], third[0]], [first[1]]]
    assert opens(0, 27)
    alone.append((b"alone", "daq", b""))
    while not shares[0].may_hold():
        pass
    shares[0].take()
    assert not opens(0, 27)  # its messages come alone now
