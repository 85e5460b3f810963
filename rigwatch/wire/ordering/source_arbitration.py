"""Which of several sources of samples has control of a rig: the first, until it is gone.

A source is one boot of the device. Its liveliness token says since when it has been there. While
the source in control lives, samples of another are refused and the conflict is remarked on; when it
is gone, the other takes over. A restarted device looks the same for some milliseconds, if its first
sample overtakes the news of the old token's end: then nothing of the new boot is skipped, because
no sample of the old one came in between.
"""

from dataclasses import dataclass

from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.ordering.numbered import Numbered

OLD_NS = 5_000_000_000
"""A new boot without a token whose samples are older than the last by this is a replay [ns]."""


@dataclass(slots=True)
class Rival:
    """A source without control: numbers of its samples seen so far.

    Attributes:
        first: its first sample seen.
        last: its latest sample seen.
        from_seq: what to begin with should it take over.
        told: the conflict has been remarked on.
    """

    first: int
    last: int
    from_seq: int
    told: bool = False


@dataclass(frozen=True, slots=True)
class Verdict:
    """About one block: take control beginning with sample `control_from`, and what to tell."""

    control_from: int | None = None
    remark: str = ""


class Sources:
    """The sources heard of, and which of them has control."""

    def __init__(self) -> None:
        self.current: int | None = None
        self._alive: dict[int, int] = {}
        self._had_token: set[int] = set()
        self._silent = False
        self._latest_ns = -(2**62)
        self._rivals: dict[int, Rival] = {}

    def is_alive(self, boot: int) -> bool:
        """Whether the boot's token is there now."""
        return boot in self._alive

    @property
    def contested(self) -> bool:
        """Whether a second source sends samples beside the one in control."""
        return any(
            rival.told and (boot in self._alive or boot not in self._had_token)
            for boot, rival in self._rivals.items()
        )

    def appeared(self, boot: int, since_ns: int) -> None:
        """The boot's token is there, put up at `since_ns`."""
        self._alive[boot] = since_ns
        self._had_token.add(boot)

    def vanished(self, boot: int, since_ns: int) -> tuple[int, int] | None:
        """The boot's token is gone; returns the samples skipped of it if it never had control."""
        if self._alive.get(boot, since_ns) != since_ns:
            return (
                None  # the same boot came back with a newer token before the old one's end was told
            )
        self._alive.pop(boot, None)
        rival = self._rivals.get(boot)
        if rival is None or self._released():
            return None
        del self._rivals[boot]
        return rival.first, rival.last

    def fell_silent(self) -> tuple[int, int] | None:
        """Nothing has come for a while; returns who takes over, as `successor`."""
        self._silent = True
        return self.successor()

    def successor(self) -> tuple[int, int] | None:
        """(boot, first sample) of the rival that takes over, where control is free."""
        if not self._rivals or not self._released():
            return None
        boot = min(self._rivals, key=lambda b: self._alive.get(b, 2**63))
        return boot, self._rivals[boot].from_seq

    def take_control(self, boot: int) -> None:
        """From now on `boot` has control."""
        self.current = boot
        self._silent = False
        self._rivals.pop(boot, None)

    def skipped_from(self, boot: int, resumed: int) -> int:
        """The first sample that counts as skipped when a rival takes over."""
        rival = self._rivals.get(boot)
        return max(resumed, rival.first) if rival and rival.from_seq > 0 else resumed

    def judge(self, block: SampleBlock | Numbered) -> Verdict:
        """What a block means for who has control."""
        if block.boot == self.current:
            return self._current_spoke(block)
        if self.current is None:
            return Verdict(control_from=block.seq if self._is_oldest(block.boot) else None)
        return self._other_spoke(block)

    def _current_spoke(self, block: SampleBlock | Numbered) -> Verdict:
        self._silent = False
        self._latest_ns = max(self._latest_ns, int(block.t_ns[-1]))
        for rival in self._rivals.values():
            rival.from_seq = rival.last + 1
        untold = [boot for boot, rival in self._rivals.items() if not rival.told]
        return Verdict(remark=self._conflict(untold[0])) if untold else Verdict()

    def _other_spoke(self, block: SampleBlock | Numbered) -> Verdict:
        boot, end = block.boot, block.seq + len(block) - 1
        if not self.is_alive(boot) and self._is_past(block):
            return Verdict()
        rival = self._rivals.get(boot)
        if rival is None:
            rival = self._rivals[boot] = Rival(block.seq, end, 0)
        rival.last = max(rival.last, end)
        if self._released():
            return Verdict(control_from=rival.from_seq)
        certain = self.is_alive(boot) and self.current in self._alive
        return Verdict(remark=self._conflict(boot)) if certain and not rival.told else Verdict()

    def _is_past(self, block: SampleBlock | Numbered) -> bool:
        """A straggler of a source that is gone, or a recording of one."""
        return block.boot in self._had_token or int(block.t_ns[0]) < self._latest_ns - OLD_NS

    def _conflict(self, boot: int) -> str:
        self._rivals[boot].told = True
        return f"boot {boot} sends samples too; boot {self.current} came first and keeps control"

    def _released(self) -> bool:
        if self.current in self._had_token:
            return self.current not in self._alive
        return self._silent

    def _is_oldest(self, boot: int) -> bool:
        since = self._alive.get(boot)
        return not self._alive if since is None else since == min(self._alive.values())
