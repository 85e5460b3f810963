"""Draws on where a clock was set back in a recording: its messages, at times that go on.

A viewer shows what it has in order of time, so that what came after the step would lie among what
came before it. From the step on, all times are later by as much as the clock was set back.

    samples   ──▶ Step, Step, …      once for the recording
    messages  ──▶ Continued.moved    in recorded order
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from rigwatch.dashboard.board import SET_BACK_NS
from rigwatch.wire.messages import EstimateBlock, Message, SampleBlock


@dataclass(frozen=True, slots=True)
class Step:
    """Where the clock was set back.

    Attributes:
        boot, seq: the first sample after it.
        by_ns: by how much all times from there on are later [ns].
    """

    boot: int
    seq: int
    by_ns: int


def steps_back(samples: Iterable[SampleBlock]) -> list[Step]:
    """Where the clock of a recording was set back.

    Args:
        samples: all of them, in order; a step lies between two blocks.
    """
    found, before_ns = list[Step](), 0
    for block, by_ns in _followed(samples):
        if by_ns != before_ns:
            found.append(Step(block.boot, block.seq, by_ns))
        before_ns = by_ns
    return found


def drawn_ns(samples: Iterable[SampleBlock]) -> int:
    """Time from the first sample to the last as they are drawn [ns]; 0 without samples."""
    first = last = 0
    for block, by_ns in _followed(samples):
        first, last = first or int(block.t_ns[0]), int(block.t_ns[-1]) + by_ns
    return last - first


def _followed(samples: Iterable[SampleBlock]) -> Iterator[tuple[SampleBlock, int]]:
    """Each block, and by how much the clock has been set back before it [ns]."""
    by_ns, last_ns = 0, dict[str, int]()
    for block in samples:
        first_ns = int(block.t_ns[0])
        behind_ns = last_ns.get(block.device, first_ns) - first_ns
        if behind_ns > SET_BACK_NS:
            by_ns += behind_ns
        last_ns[block.device] = int(block.t_ns[-1])
        yield block, by_ns


class Continued:
    """Moves the messages of one stream of a recording.

    Args:
        steps: of the recording.
    """

    def __init__(self, steps: list[Step]) -> None:
        self._steps = steps
        self._passed = 0
        self._newest_ns = 0

    def moved(self, message: Message) -> Message:
        """The next message at the time at which it is drawn."""
        if isinstance(message, SampleBlock | EstimateBlock):
            return self._block(message) if len(message) else message
        if not self._newest_ns:
            return message
        # What was said before a step may be recorded after the samples behind it.
        passed = range(max(0, self._passed - 1), self._passed + 1)
        times = [message.t_ns + self._by_ns(number) for number in passed]
        return replace(message, t_ns=min(times, key=lambda t_ns: abs(t_ns - self._newest_ns)))

    def _block(self, block: SampleBlock | EstimateBlock) -> Message:
        self._follow(block)
        t_ns = block.t_ns + self._by_ns(self._passed)
        self._newest_ns = int(t_ns[-1])
        return replace(block, t_ns=t_ns)

    def _follow(self, block: SampleBlock | EstimateBlock) -> None:
        while self._passed < len(self._steps):
            step = self._steps[self._passed]
            if block.boot != step.boot or block.seq < step.seq:
                return
            self._passed += 1

    def _by_ns(self, passed: int) -> int:
        return self._steps[passed - 1].by_ns if passed else 0
