"""The states of one alarm after ISA-18.2, and the transitions between them.

                       condition holds                        condition holds again
        ┌──────────┐  for `persistence`   ┌────────────────┐ ◀───────────────────────┐
        │  normal  │ ───────────────────▶ │ unacknowledged │ ──── condition gone ──┐ │
        └──────────┘                      └────────────────┘  for `clear_after`    ▼ │
         ▲   ▲    ▲                               │ acknowledge     ┌────────────────────────┐
         │   │    │   condition gone,             ▼                 │ cleared_unacknowledged │
         │   │    │   not latched         ┌──────────────┐          └────────────────────────┘
         │   │    └────────────────────── │ acknowledged │ ◀── acknowledge, latched ──┘  │
         │   └──── reset, once gone ───── └──────────────┘                               │
         └───────────────────── acknowledge, not latched (any more) ─────────────────────┘

A latching alarm stays acknowledged after its condition has gone (the standard's state F, latched
acknowledged) until an operator resets it. `reset` on a cleared, unacknowledged alarm only releases
the latch (E to D): it must still be acknowledged. `reset` while the condition holds is refused. A
remark (severity info) is acknowledged from the start and never latches. Shelving keeps an alarm in
normal regardless of its condition, for a limited time.
"""

from dataclasses import dataclass, field

from monitor.alarms.actor import NOBODY, Actor
from monitor.alarms.flapping import FlapWatch
from monitor.alarms.kinds import REFINED, AlarmKind, AlarmSettings, kind_of, split
from rigwatch.wire.messages import Alarm, AlarmState, Identity

UNSEEN: tuple[AlarmState, ...] = ("unacknowledged", "cleared_unacknowledged")


@dataclass(frozen=True, slots=True)
class Occasion:
    """Cause of a transition: sample, time, and the value with its limits.

    Attributes:
        device, boot, seq, t_ns: the sample; seq -1 if not caused by a sample.
        value, low, high: the value judged and its limits; NaN if there are none.
        onset_seq: first sample at which the condition held; -1 if there is none.
        text: added to the cause.
    """

    device: str = ""
    boot: int = 0
    seq: int = -1
    t_ns: int = 0
    value: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    onset_seq: int = -1
    text: str = ""


@dataclass(slots=True)
class AlarmInstance:
    """One alarm and its state.

    Attributes:
        name: the alarm's name.
        settings: its settings.
        state: state of ISA-18.2 as published.
        active: whether the condition holds, after persistence and hysteresis.
        latched: an operator must still reset it.
        shelved_until_ns: end of shelving [ns]; 0 if not shelved.
        shelved_by: who shelved it, and the remark.
        superseded: an alarm that refines it has replaced it in this episode.
        first_out: it was raised while no other alarm was unacknowledged.
        grouped: it is hidden in a flood.
        occasion: what raised it, or its value told again.
        since_ns: when it was raised [ns].
        flaps: recent occurrences.
    """

    name: str
    settings: AlarmSettings
    kind: AlarmKind = field(init=False)
    state: AlarmState = "normal"
    active: bool = False
    latched: bool = False
    shelved_until_ns: int = 0
    shelved_by: Actor = NOBODY
    superseded: bool = False
    first_out: bool = False
    grouped: bool = False
    occasion: Occasion = field(default_factory=Occasion)
    since_ns: int = 0
    flaps: FlapWatch = field(default_factory=FlapWatch)

    def __post_init__(self) -> None:
        self.kind = kind_of(self.name)

    @property
    def is_remark(self) -> bool:
        """Whether it needs no acknowledgement."""
        return self.kind.severity == "info"

    @property
    def cause(self) -> str:
        """What is probably wrong, with the channel's name filled in."""
        return self.kind.cause.format(channel=split(self.name)[1])

    def added_to(self, cause: str) -> str:
        """Addition to the alarm's own text in a published `cause`; "" for none."""
        own = f"{self.cause}: "
        return cause.removeprefix(own) if cause.startswith(own) else ""

    @property
    def may_flap(self) -> bool:
        """Whether chattering is counted; names of one fault replace each other instead."""
        return not self.kind.refines and self.kind.name not in REFINED

    @property
    def stands_for_fault(self) -> bool:
        """Whether the list shows it, or would if it were not shelved."""
        return self.state != "normal" or (self.active and self.shelved_until_ns > 0)

    def raise_(self, occasion: Occasion, *, first_out: bool) -> None:
        """The condition has become true: the alarm becomes unacknowledged from any state."""
        self.state = "acknowledged" if self.is_remark else "unacknowledged"
        self.latched = self.settings.latch and not self.is_remark
        self.first_out, self.occasion = first_out, occasion
        self.since_ns = occasion.t_ns

    def clear(self) -> bool:
        """The condition has become false; returns whether the published state changed."""
        if self.state == "unacknowledged":
            self.state = "cleared_unacknowledged"
            return True
        if self.state == "acknowledged" and not self.latched:
            self.state = "normal"
            return True
        return False

    def acknowledge(self) -> bool:
        """An operator acknowledges it; returns whether the state changed."""
        if self.state not in UNSEEN:
            return False
        gone = self.state == "cleared_unacknowledged"
        self.state = "normal" if gone and not self.latched else "acknowledged"
        return True

    def reset(self) -> bool:
        """An operator releases the latch; returns whether that was possible."""
        if self.active or not self.latched:
            return False
        self.latched = False
        if self.state == "acknowledged":
            self.state = "normal"
        return True

    def dismiss(self) -> bool:
        """Return to normal without acknowledgement: shelved, or replaced by a refining alarm."""
        was_standing = self.state != "normal"
        self.state, self.latched, self.grouped = "normal", False, False
        return was_standing

    def message(self, user: str = "", t_ns: int | None = None, identity: Identity = "") -> Alarm:
        """The alarm as published; changed at `t_ns` [ns] by `user`, otherwise by its occasion."""
        at = self.occasion
        counted = f"came {self.flaps.count} times" if self.flaps.holding else ""
        text = "; ".join(filter(None, (at.text, counted)))
        return Alarm(
            name=self.name,
            state=self.state,
            severity=self.kind.severity,
            cause=f"{self.cause}: {text}" if text else self.cause,
            guidance=self.kind.guidance,
            device=at.device,
            boot=at.boot,
            seq=at.seq,
            t_ns=at.t_ns if t_ns is None else t_ns,
            value=at.value,
            low=at.low,
            high=at.high,
            first_out=self.first_out,
            user=user,
            onset_seq=at.onset_seq,
            identity=identity,
        )
