"""What recordings fill in, without clock or bus: in order, and none twice."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.recorder.past import BlockStream, Outage, Page, PastServer, Question, serving
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import (
    ESTIMATES,
    EVENTS,
    SAMPLES,
    Event,
    Gap,
    Health,
    Message,
    SampleBlock,
    decode,
    encode,
)
from rigwatch.wire.session import SessionWriter, run_info
from tests.bus.samples import PERIOD_NS, block
from tests.sites.source import estimates

SECOND = 10**9


def lost(first: int, last: int, topic: str = "") -> Gap:
    return Gap("rig", 7, first, last, 0, "headquarters", "the ring no longer has them", topic)


def numbers(items: list[Message]) -> list[tuple[int, int]]:
    return [
        (b.boot, n)
        for b in items
        if isinstance(b, SampleBlock)
        for n in range(b.seq, b.seq + len(b))
    ]


@given(st.lists(st.tuples(st.integers(0, 140), st.integers(1, 40)), max_size=12), st.data())
def test_whatever_a_recording_repeats_each_sample_comes_once(pieces, data) -> None:
    """Blocks of any cut, twice or overlapping, as long as they are in order."""
    stream = BlockStream()
    out = stream.add([block(0, 50), lost(50, 99), block(100, 20)])
    assert stream.hole is not None
    held = stream.add([block(120, 5)])
    assert not held
    for first, length in sorted(pieces):
        out += stream.fill([block(first, length)])
    found = numbers(out)
    assert found == sorted(set(found))
    out += stream.end(answered=True)
    gaps = {n for g in out if isinstance(g, Gap) for n in range(g.first, g.last + 1)}
    seqs = [seq for _, seq in numbers(out)]
    assert len(seqs) == len(set(seqs))
    assert set(seqs) | gaps == set(range(125))
    assert not set(seqs) & gaps


def test_a_start_of_the_device_of_which_nothing_was_heard_is_filled_in() -> None:
    stream = BlockStream()
    out = stream.add([block(0, 10), lost(10, 9), block(5, 10, boot=9, start_ns=SECOND)])
    out += stream.fill([block(0, 12), block(0, 7, boot=8), block(0, 9, boot=9)])
    out += stream.end(answered=True)
    expected = [(7, n) for n in range(12)] + [(8, n) for n in range(7)]
    assert numbers(out) == expected + [(9, n) for n in range(15)]


def test_without_an_answer_the_gap_stays_and_reading_goes_on() -> None:
    stream = BlockStream()
    items: list[Message] = [block(0, 10), lost(10, 19), block(20, 5), lost(25, 29), block(30, 5)]
    out = stream.add(items)
    out += stream.end(answered=False)
    assert [g for g in out if isinstance(g, Gap)] == [lost(10, 19)]
    out += stream.fill([block(25, 5)])
    out += stream.end(answered=True)
    assert numbers(out) == [(7, n) for n in (*range(10), *range(20, 35))]


def test_a_gap_before_anything_was_heard_is_reported_as_it_is() -> None:
    assert BlockStream().add([lost(0, 4), block(5, 5)])[0] == lost(0, 4)


def health(t_ns: int) -> Health:
    return Health("recorder", t_ns, "recording", "", {})


def event(t_ns: int) -> Event:
    return Event("monitor", t_ns, "info", "CODE", f"at {t_ns}")


def test_events_of_an_outage_come_once_whether_early_or_late() -> None:
    outage = Outage()
    assert outage.hear(health(10 * SECOND))
    assert outage.hear(event(10 * SECOND))
    outage.link(up=False)
    outage.link(up=True)
    assert outage.gap(lost(0, 3, "alarms")) == []
    assert outage.hear(health(60 * SECOND))
    assert outage.span is not None
    assert outage.span.start < 10 * SECOND < 60 * SECOND < outage.span.end
    times = [10 * SECOND, 30 * SECOND, 59 * SECOND]
    found = outage.fill([(EVENTS, encode(event(t))) for t in times])
    assert found == [event(t) for t in times[1:]]
    assert not outage.hear(event(59 * SECOND))  # late, out of a ring
    assert outage.end(answered=True) == []
    assert outage.gap(lost(4, 4, "alarms")) == []  # one more of the same outage: asked again
    assert outage.span is not None
    assert outage.end(answered=False) == [lost(4, 4, "alarms")]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[PastServer]:
    """Three segments of ten seconds each, the last one killed."""
    folder = tmp_path / "bench-20260501T120000Z"
    folder.mkdir()
    for number in range(3):
        writer = SessionWriter(folder / f"{number + 1:06d}.mcap", run_info("bench", 256.0, t_ns=1))
        for part in range(20):
            seq = number * 2560 + part * 128
            samples = block(seq, 128)
            writer.write(samples)
            writer.write(estimates(seq, 7, samples.t_ns))
            writer.write(event(int(samples.t_ns[0])))
            writer.flush()
        if number < 2:
            writer.close()
    with (folder / "000003.mcap").open("ab") as file:
        file.write(b"\x06half a chunk")
    bus = MemoryNetwork().bus("bench", "recorder")
    made = PastServer(bus, tmp_path, lambda: 42)
    yield made
    made.close()


def asked(server: PastServer, question: Question) -> tuple[list[Message], int]:
    """All messages of an answer, and the number of its pages."""
    found: list[Message] = []
    pages = 0
    while True:
        page = Page.from_bytes(server.page(question).to_bytes())
        assert page.settled == 42
        found += [decode(line.message, data) for line, data in page.parts]
        pages += 1
        if page.bookmark is None:
            return found, pages
        question = Question(question.topics, question.start, question.end, page.bookmark)


def test_pages_hold_each_message_of_the_span_once(server: PastServer) -> None:
    start, end = 1000 * PERIOD_NS, 6500 * PERIOD_NS
    samples, _ = asked(server, Question((SAMPLES.name,), start, end))
    assert numbers(samples) == [(7, n) for n in range(1000, 6500)]
    both, pages = asked(server, Question((ESTIMATES.name, EVENTS.name), start, end))
    assert pages > 5
    at = [n for m in both if not isinstance(m, Event) for n in range(m.seq, m.seq + len(m))]
    assert at == list(range(1000, 6500))
    assert sum(isinstance(m, Event) for m in both) == 6500 // 128 - 1000 // 128
    assert asked(server, Question((SAMPLES.name,), 10**15, 2 * 10**15))[0] == []


def test_a_page_that_finds_little_ends_in_time_and_the_next_goes_on(
    server: PastServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serving, "PAGE_TIME", 0.0)
    question = Question((EVENTS.name,), 1000 * PERIOD_NS, 6500 * PERIOD_NS)
    found, pages = asked(server, question)
    assert sum(isinstance(m, Event) for m in found) == 6500 // 128 - 1000 // 128
    assert pages > 30, "a page for each chunk"


def test_whoever_asks_without_end_gets_no_more_than_the_rate_and_keeps_nobody_waiting(
    server: PastServer,
) -> None:
    question = Question((SAMPLES.name,), 0, 6500 * PERIOD_NS).to_bytes()
    began, answered, refused, longest = time.monotonic(), 0, 0, 0.0
    while refused < 1000:
        at = time.monotonic()
        found = server.answer(question)
        longest = max(longest, time.monotonic() - at if not found else 0.0)
        answered, refused = answered + sum(map(len, found)), refused + (not found)
    spent = time.monotonic() - began
    assert 0 < answered <= (spent + 1.1) * serving.BYTES_PER_SECOND
    assert longest < serving.AHEAD, "a refusal waits for nothing"


def test_what_is_no_question_gets_no_answer(server: PastServer) -> None:
    for data in (b"", b"{}", b'{"topics": "x"}', b"[" * 5000, b"\xff"):
        with pytest.raises(MessageError):
            Question.from_bytes(data)
    for data in (b"", b"\x05\x00\x00\x00{}", server.page(Question((), 0, 1)).to_bytes() + b"\x01"):
        with pytest.raises(MessageError):
            Page.from_bytes(data)
    elsewhere = Question.from_bytes(
        b'{"topics": ["samples"], "start": 0, "end": 9000000000000,'
        b' "bookmark": {"segment": "../../etc/passwd", "offset": -5, "parts": -1}}'
    )
    assert asked(server, elsewhere)[0]  # from the first segment behind it, all of which exist
