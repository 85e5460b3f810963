"""Arbitration between sources of samples: the first has control of a rig until it is gone.

A source is one boot of the device. Its liveliness token gives its start time. While the source in
control is alive, samples of another are refused and the conflict is reported; when it is gone, the
other takes over. A restarted device looks the same for some milliseconds if its first sample
arrives before the end of the old token is known. In that case nothing of the new boot is skipped,
because no sample of the old one arrived in between.

A token proves nothing: without keys anybody can declare one with an early start. A reader that has
joined no source yet therefore passes over those that send nothing, if another one does.
"""

from dataclasses import dataclass

from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.ordering.numbered import Numbered, NumberedRun

OLD_NS = 5_000_000_000
"""Age of samples, relative to the last, from which a new boot without token is a replay [ns]."""
REMEMBERED = 64
"""Sources that are gone and still known: in a year a rig has thousands of them."""
MOST_RIVALS = 16
"""Sources without a token that are followed at a time: any sender can make up more of them."""


@dataclass(slots=True)
class Rival:
    """A source without control: numbers of its samples received so far.

    Attributes:
        first: its first sample received.
        last: its latest sample received.
        from_seq: the sample to start with if it takes over.
        told: the conflict has been reported.
    """

    first: int
    last: int
    from_seq: int
    told: bool = False


@dataclass(frozen=True, slots=True)
class Verdict:
    """Decision on one block: take control from sample `control_from` on, and a remark."""

    control_from: int | None = None
    remark: str = ""


NO_CHANGE = Verdict()
"""The decision on nearly every block."""


class Sources:
    """The known sources, and the one in control."""

    def __init__(self) -> None:
        self.current: int | None = None
        self._alive: dict[int, int] = {}
        self._since: dict[int, int] = {}
        self._in_control_since: dict[int, int] = {}
        self._interrupted: set[int] = set()
        self._silent = False
        self._latest_ns = -(2**62)
        self._rivals: dict[int, Rival] = {}
        self._passed: set[int] = set()

    def is_alive(self, boot: int) -> bool:
        """Whether the boot's token exists."""
        return boot in self._alive

    @property
    def any_alive(self) -> bool:
        """Whether any source's token exists."""
        return bool(self._alive)

    @property
    def contested(self) -> bool:
        """Whether a second source sends samples besides the one in control, or was passed over."""
        return not self._passed.isdisjoint(self._alive) or any(
            rival.told and (boot in self._alive or boot not in self._since)
            for boot, rival in self._rivals.items()
        )

    def appeared(self, boot: int, since_ns: int) -> None:
        """The boot's token has appeared, declared at `since_ns`."""
        if boot not in self._alive and self._since.get(boot) == since_ns:
            self._interrupted.add(boot)
        self._since.pop(boot, None)
        self._alive[boot] = self._since[boot] = since_ns
        if boot == self.current:
            self._in_control_since[boot] = since_ns
        self._forget()

    def returns(self, boot: int) -> bool:
        """Whether the boot was in control, and its token was gone only with the router.

        All tokens vanish with a router and reappear in any order: a rival that reappears first must
        not keep control.
        """
        if boot == self.current or boot not in self._interrupted:
            return False
        was_in_control = self._in_control_since.get(boot) == self._since[boot]
        both = self.current in self._interrupted or self.current not in self._alive
        now = self._alive.get(self.current or 0, 2**63)
        return was_in_control and both and self._since[boot] < now

    def vanished(self, boot: int, since_ns: int) -> tuple[int, int] | None:
        """The boot's token has vanished; returns its skipped samples if it never had control."""
        if self._alive.get(boot, since_ns) != since_ns:
            # The same boot returned with a newer token before the end of the old one was reported.
            return None
        self._alive.pop(boot, None)
        if self.current is None:
            self._rivals.pop(boot, None)
            return None
        rival = self._rivals.get(boot)
        if rival is None or self._released():
            return None
        del self._rivals[boot]
        return rival.first, rival.last

    def fell_silent(self) -> tuple[int, int] | None:
        """Handle silence; returns the boot that takes over, as `successor`."""
        self._silent = True
        return self.successor()

    def successor(self) -> tuple[int, int] | None:
        """(boot, first sample) of the rival that takes over, if control is free.

        One that has neither a token nor sent anything since the source in control last did is no
        successor: it takes over once it sends again.
        """
        sending = [b for b, one in self._rivals.items() if b in self._alive or not one.from_seq]
        if not sending or self.current is None or not self._released():
            return None
        boot = min(sending, key=lambda b: self._alive.get(b, 2**63))
        return boot, self._rivals[boot].from_seq

    def pass_over(self) -> tuple[int, int] | None:
        """(boot, first sample) of the oldest source that sends while none has control.

        The older ones, which send nothing, are passed over. None if no such source sends.
        """
        if self.current is not None or not self._rivals:
            return None
        boot = min(self._rivals, key=lambda b: self._alive[b])
        self._passed = {b for b, since in self._alive.items() if since < self._alive[boot]}
        return boot, self._rivals[boot].first

    def take_control(self, boot: int) -> None:
        """Give control to `boot`."""
        self.current = boot
        if boot in self._alive:
            self._in_control_since[boot] = self._alive[boot]
        self._silent = False
        self._rivals.pop(boot, None)

    def skipped_from(self, boot: int, resumed: int) -> int:
        """The first sample that counts as skipped when a rival takes over."""
        rival = self._rivals.get(boot)
        return max(resumed, rival.first) if rival and rival.from_seq > 0 else resumed

    def judge(self, block: SampleBlock | Numbered) -> Verdict:
        """Decide whether a block changes control."""
        if block.boot == self.current:
            return self._current_spoke(block)
        if self.current is not None:
            return self._other_spoke(block)
        if self._is_oldest(block.boot):
            return Verdict(control_from=block.seq)
        if self.is_alive(block.boot):
            self._rival(block)
        return NO_CHANGE

    def goes_on(self, block: SampleBlock | Numbered | NumberedRun) -> bool:
        """Whether the source in control speaks while no other does, which changes nothing."""
        if not self.is_unrivalled(block.boot):
            return False
        self._hear(block)
        return True

    def is_unrivalled(self, boot: int) -> bool:
        """Whether a source has control and no other speaks."""
        return boot == self.current and not self._rivals

    def went_on(self, t_ns: int) -> None:
        """The source in control has spoken, at last at `t_ns`, and no other has."""
        self._silent = False
        self._latest_ns = t_ns  # the clock may have been set back

    def _hear(self, block: SampleBlock | Numbered | NumberedRun) -> None:
        self.went_on(int(block.t_ns[-1]))

    def _current_spoke(self, block: SampleBlock | Numbered) -> Verdict:
        self._hear(block)
        if not self._rivals:
            return NO_CHANGE
        for rival in self._rivals.values():
            rival.from_seq = rival.last + 1
        untold = [boot for boot, rival in self._rivals.items() if not rival.told]
        return Verdict(remark=self._conflict(untold[0])) if untold else Verdict()

    def _other_spoke(self, block: SampleBlock | Numbered) -> Verdict:
        boot = block.boot
        if not self.is_alive(boot) and self._is_past(block):
            return Verdict()
        rival = self._rival(block)
        if self._released():
            return Verdict(control_from=rival.from_seq)
        certain = self.is_alive(boot) and self.current in self._alive
        return Verdict(remark=self._conflict(boot)) if certain and not rival.told else Verdict()

    def _rival(self, block: SampleBlock | Numbered) -> Rival:
        """The source of a block, which has no control, as it is after it."""
        boot, end = block.boot, block.seq + len(block) - 1
        rival = self._rivals.get(boot)
        if rival is None:
            self._make_room(boot)
            rival = self._rivals[boot] = Rival(block.seq, end, 0)
        rival.last = max(rival.last, end)
        return rival

    def _make_room(self, boot: int) -> None:
        """Drop the oldest rival without a token if another one is too many."""
        unproved = [rival for rival in self._rivals if rival not in self._since]
        if boot not in self._since and len(unproved) >= MOST_RIVALS:
            del self._rivals[unproved[0]]

    def _forget(self) -> None:
        """Forget the sources that have been gone for longest."""
        kept = {self.current, *self._alive, *self._rivals}
        gone = [boot for boot in self._since if boot not in kept]
        for boot in gone[: max(0, len(gone) - REMEMBERED)]:
            del self._since[boot]
            self._in_control_since.pop(boot, None)
            self._interrupted.discard(boot)

    def _is_past(self, block: SampleBlock | Numbered) -> bool:
        """Whether a block is a late one of a source that is gone, or a recording."""
        return block.boot in self._since or int(block.t_ns[0]) < self._latest_ns - OLD_NS

    def _conflict(self, boot: int) -> str:
        self._rivals[boot].told = True
        return f"boot {boot} sends samples too; boot {self.current} came first and keeps control"

    def _released(self) -> bool:
        if self.current in self._since:
            return self.current not in self._alive
        return self._silent

    def _is_oldest(self, boot: int) -> bool:
        since = self._alive.get(boot)
        return not self._alive if since is None else since == min(self._alive.values())
