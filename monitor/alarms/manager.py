"""All alarms of a rig: conditions, reports and commands in, transitions out.

`update` takes the per-sample conditions of a block, `report` conditions that processes detect
without a sample (link, disk, clock), `command` an operator's command. Each returns the messages to
publish. The manager reads no clock and no file; the division into blocks has no influence.

A fault is detected before it is named. `departure` is raised first. If `dry_friction`, `stiction`
or `other_fault` follows while the departure lasts, it replaces the departure in the list, with the
departure's `onset_seq` and first-out mark, so that one fault is one alarm under its most precise
name.

The first alarm raised while no other is unacknowledged is the first-out. In a flood (`flood.py`)
further alarms are journalled but announced only as events until the flood ends; critical alarms and
those that require stopping the rig are always shown. A chattering alarm is one alarm with a count
(`flapping.py`). The value of some becomes better while they stand and is told again
(`telling.py`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from monitor.alarms.actor import NOBODY, Actor
from monitor.alarms.debounce import Debouncer
from monitor.alarms.flood import MOST_IN_WINDOW, FloodWatch
from monitor.alarms.kinds import (
    ALARM_FLOOD,
    REFINED,
    REPORTED,
    check_settings,
    order_of,
    settings_of,
)
from monitor.alarms.operator import addressed, refusal
from monitor.alarms.record import AlarmRecord
from monitor.alarms.restoring import let_go, restore_from
from monitor.alarms.state import UNSEEN, AlarmInstance, Occasion
from monitor.alarms.telling import figure_of, next_telling
from monitor.signals import Condition
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.messages import NOT_PROVED, Alarm, AlarmCommand, Event, Identity
from rigwatch.wire.rig_config import AlarmSection

Announcement = Alarm | Event
Deadline = tuple[int, str, Callable[[AlarmInstance, int], None]]

SHELF_LIFE_NS = 8 * 3600 * 1_000_000_000
"""Longest shelving: one shift, so that no alarm is forgotten on the shelf."""
SOURCE = "monitor/alarms"
_SHELF_TIME_OVER = Actor(text="its time on the shelf is over")


class AlarmManager:
    """The alarms of one device.

    Args:
        settings: sections by alarm or kind of alarm, from [monitor.alarms].
        file: the configuration's name, for errors.
        longest_hold: missing samples that the estimates bridge.

    Raises:
        ConfigError: a section names no alarm.
    """

    def __init__(
        self,
        settings: Mapping[str, AlarmSection] | None = None,
        file: str = "configuration",
        longest_hold: int = 0,
    ) -> None:
        self._longest_hold = longest_hold
        self._settings = dict(settings or {})
        check_settings(self._settings, file)
        self._alarms: dict[str, AlarmInstance] = {}
        self._inherited: set[str] = set()
        self._debouncers: dict[str, Debouncer] = {}
        self._at_rest = False
        self._flood = FloodWatch()
        self._first_out = ""
        self._next: tuple[int, int] | None = None
        self._due_ns: int | None = 0
        self._said: list[Announcement] = []
        self._changes: list[AlarmRecord] = []

    def update(
        self,
        device: str,
        boot: int,
        seq: int,
        t_ns: IntArray,
        conditions: Iterable[Condition],
    ) -> list[Announcement]:
        """Process the conditions of consecutive samples.

        Args:
            device: the device of the samples.
            boot: boot of the samples.
            seq: number of the first one.
            t_ns: shape (n,), their times [ns].
            conditions: each over the same n samples; one that is missing keeps its level.
        """
        self._follow(boot, seq, len(t_ns))
        held = list(conditions)
        improving = [condition for condition in held if condition.told]
        for index, name, rising, at in sorted(
            self._edges(device, boot, seq, t_ns, held), key=lambda row: row[:2]
        ):
            self._tell_again(improving, boot, seq, t_ns[:index])
            self._advance(int(t_ns[index]))
            self._set(name[1], at, active=rising)
        self._tell_again(improving, boot, seq, t_ns)
        if len(t_ns):
            self._advance(int(t_ns[-1]))
            # What was raised by what has ended in between.
            self._tell_again(improving, boot, seq, t_ns)
        return self._take_announcements()

    def report(self, name: str, at: Occasion, *, active: bool) -> list[Announcement]:
        """Set a condition detected without a sample: whether `name` holds since `at`.

        Repeating the same report has no effect. Persistence and hysteresis are counted in samples
        and do not apply here.
        """
        self._advance(at.t_ns)
        if self.holds(name) != active:
            self._set(name, at, active=active)
        return self._take_announcements()

    def reword(self, name: str, text: str, t_ns: int) -> list[Announcement]:
        """Announce an alarm again, in its state, whose condition now holds for another reason.

        Args:
            name: the alarm; nothing happens unless it stands and its condition holds.
            text: the reason; nothing happens if it has been told.
            t_ns: Unix time [ns].
        """
        self._advance(t_ns)
        alarm = self._alarms.get(name)
        if alarm and alarm.active and alarm.state != "normal" and alarm.occasion.text != text:
            alarm.occasion = replace(alarm.occasion, text=text)
            self._publish(alarm, t_ns)
        return self._take_announcements()

    def pass_to(self, t_ns: int) -> list[Announcement]:
        """Process what is due by `t_ns` [ns], such as the end of a shelving."""
        self._advance(t_ns)
        return self._take_announcements()

    def set_back(self, by_ns: int) -> None:
        """The clock of all times has been set back [ns]: what lasts ends as much sooner by it."""
        self._due_ns = 0
        self._flood.set_back(by_ns)
        for alarm in self._alarms.values():
            alarm.flaps.set_back(by_ns)
            if alarm.shelved_until_ns:
                alarm.shelved_until_ns -= by_ns

    def holds(self, name: str) -> bool:
        """Whether the condition of `name` was last known to hold."""
        known = self._alarms.get(name)
        return known is not None and known.active

    def command(self, command: AlarmCommand, identity: Identity = NOT_PROVED) -> list[Announcement]:
        """Execute an operator's command, or return an event with the reason for its refusal.

        Args:
            command: of the operator.
            identity: whether its user is proved by a signature.
        """
        self._advance(command.t_ns)
        self._due_ns = 0
        found = addressed(command, self._alarms.values())
        why_not = refusal(command, found)
        if why_not:
            self._tell("alarm_command_refused", why_not, command.t_ns)
            return self._take_announcements()
        actor = Actor(command.user, identity, command.text)
        for alarm in found:
            self._obey(alarm, command, actor)
        self._raise_unnamed(command.t_ns)
        return self._take_announcements()

    def standing(self) -> list[Alarm]:
        """Every alarm that is not normal, first-out first, then in order of time."""
        alarms = [alarm.message() for alarm in self._alarms.values() if alarm.state != "normal"]
        return sorted(alarms, key=lambda alarm: (not alarm.first_out, alarm.t_ns))

    def shelved(self) -> list[AlarmRecord]:
        """Every alarm that an operator has put aside, by whom, until when and why."""
        return [
            _record(alarm, None, alarm.shelved_by)
            for alarm in self._alarms.values()
            if alarm.shelved_until_ns
        ]

    def take_changes(self) -> list[AlarmRecord]:
        """Records for the journal since the last call, in order."""
        changes, self._changes = self._changes, []
        return changes

    def restore(self, records: Iterable[AlarmRecord], now_ns: int | None = None) -> list[Alarm]:
        """Restore the state of the records and return the standing alarms to be published again.

        Args:
            records: the newest of each alarm.
            now_ns: Unix time; shelving ends at most one shelf life after it [ns].
        """
        self._due_ns = 0
        for record in records:
            self._restore_one(record)
        for alarm in list(self._alarms.values()):
            if now_ns is not None:
                alarm.shelved_until_ns = min(alarm.shelved_until_ns, now_ns + SHELF_LIFE_NS)
            t_ns = alarm.occasion.t_ns if now_ns is None else now_ns
            if why := let_go(alarm):
                alarm.occasion = replace(alarm.occasion, t_ns=t_ns)
                self._publish(alarm, t_ns, Actor(text=why))
                self._raise_unnamed(t_ns)
        over = [said for said in self._take_announcements() if isinstance(said, Alarm)]
        return [*(alarm for alarm in over if alarm.state == "normal"), *self.standing()]

    def _restore_one(self, record: AlarmRecord) -> None:
        self._at_rest = False
        alarm = self._alarm(record.alarm.name)
        restore_from(alarm, record)
        self._debouncer(alarm.name).level = alarm.active
        if alarm.active:
            self._inherited.add(alarm.name)
        if alarm.first_out and alarm.state != "normal":
            self._first_out = alarm.name

    def retire(self, watched: Iterable[str], t_ns: int) -> list[Announcement]:
        """Clear restored alarms whose condition nothing determines any more.

        Args:
            watched: names of the conditions that are determined.
            t_ns: Unix time [ns].
        """
        inherited, self._inherited = self._inherited, set()
        for name in sorted(inherited.difference(watched, REPORTED)):
            if self.holds(name):
                self._tell("alarm_not_watched", f"{name}: nothing watches for it any more", t_ns)
                self._debouncer(name).level = False
                self._set(name, Occasion(t_ns=t_ns), active=False)
        return self._take_announcements()

    @property
    def has_inherited(self) -> bool:
        """Whether alarms have been restored whose conditions have not been determined since."""
        return bool(self._inherited)

    @property
    def is_idle(self) -> bool:
        """Whether samples at which no condition holds change nothing: then none need be given."""
        if not self._at_rest:
            idle = all(one.is_idle for one in self._debouncers.values())
            self._at_rest = idle and not self._inherited
        return self._at_rest

    def is_at_rest(self, boot: int, seq: int) -> bool:
        """Whether samples from this one on change nothing as long as no condition holds."""
        return self._due_ns is None and self._next == (boot, seq) and self.is_idle

    def went_on(self, boot: int, seq: int, t_ns: int) -> None:
        """Samples at which no condition holds have come since `is_at_rest`.

        Args:
            boot, seq: the sample after them.
            t_ns: time of the last one [ns].
        """
        self._next = boot, seq
        self._advance(t_ns)

    def _follow(self, boot: int, seq: int, count: int) -> None:
        """Interrupt the debouncers where the samples do not follow the last ones."""
        before, self._next = self._next, (boot, seq + count)
        if before == (boot, seq):
            return
        missing = seq - before[1] if before and before[0] == boot else 0
        bridged = 0 < missing <= self._longest_hold
        for debouncer in self._debouncers.values():
            debouncer.interrupt(bridged=bridged)

    def _edges(
        self, device: str, boot: int, seq: int, t_ns: IntArray, conditions: Iterable[Condition]
    ) -> Iterable[tuple[int, tuple[tuple[int, str], str], bool, Occasion]]:
        """Edges of all conditions as sortable rows: place, order and name, direction, occasion."""
        for condition in conditions:
            name, self._at_rest = condition.name, False
            for edge in self._debouncer(name).update(condition.active, seq):
                i = edge.index
                at = Occasion(
                    device, boot, seq + i, int(t_ns[i]), float(condition.value[i]),
                    float(condition.low[i]), float(condition.high[i]), edge.onset_seq,
                    figure_of(condition, i),
                )  # fmt: skip
                yield i, (order_of(name), name), edge.rising, at

    def _tell_again(
        self, improving: Iterable[Condition], boot: int, seq: int, t_ns: IntArray
    ) -> None:
        """Tell values again that have become better in the first samples of these conditions."""
        for condition in improving:
            alarm = self._alarms.get(condition.name)
            if alarm is None or not alarm.active:
                continue
            part = condition._replace(
                active=condition.active[: len(t_ns)], value=condition.value[: len(t_ns)]
            )
            while alarm.active and alarm.state == "unacknowledged":
                index = next_telling(alarm, part, t_ns)
                if index is None:
                    break
                self._advance(int(t_ns[index]))
                alarm.occasion = replace(
                    alarm.occasion, boot=boot, seq=seq + index, t_ns=int(t_ns[index]),
                    value=float(part.value[index]), text=figure_of(part, index),
                )  # fmt: skip
                self._publish(alarm, alarm.occasion.t_ns)

    def _alarm(self, name: str) -> AlarmInstance:
        if name not in self._alarms:
            self._alarms[name] = AlarmInstance(name, settings_of(name, self._settings))
        return self._alarms[name]

    def _debouncer(self, name: str) -> Debouncer:
        if name not in self._debouncers:
            settings = settings_of(name, self._settings)
            self._debouncers[name] = Debouncer(settings.persistence, settings.clear_after)
        return self._debouncers[name]

    def _set(self, name: str, at: Occasion, *, active: bool) -> None:
        """Set the condition of `name`."""
        self._due_ns = 0
        alarm = self._alarm(name)
        alarm.active = active
        if not alarm.settings.enabled or alarm.shelved_until_ns:
            alarm.occasion = at
            self._raise_unnamed(at.t_ns)
        elif alarm.may_flap and self._flapped(alarm, at):
            return
        elif active:
            self._raise(alarm, at)
        else:
            self._clear(alarm, at)

    def _flapped(self, alarm: AlarmInstance, at: Occasion) -> bool:
        """Whether the condition changed within a chattering series."""
        if not alarm.active:
            return alarm.flaps.went(at.t_ns)
        if not alarm.flaps.came(at.t_ns) or alarm.state == "normal":
            return False
        alarm.occasion = at
        if alarm.flaps.is_news():
            self._publish(alarm, at.t_ns)
        return True

    def _raise(self, alarm: AlarmInstance, at: Occasion) -> None:
        if any(other.active and other.settings.enabled for other in self._refinements(alarm)):
            alarm.superseded, alarm.occasion = True, at
            self._note(alarm, at.t_ns)
            return
        named = self._named_by(alarm)
        first_out = named.first_out if named else self._is_first(alarm)
        if named:
            at = replace(at, onset_seq=named.occasion.onset_seq)
            named.superseded = named.dismiss()
            named.occasion = replace(named.occasion, boot=at.boot, seq=at.seq, t_ns=at.t_ns)
            self._publish(named, at.t_ns, Actor(text=f"named {alarm.name}"))
        alarm.raise_(at, first_out=first_out)
        self._first_out = alarm.name if first_out else self._first_out
        self._count(alarm, is_new=named is None)
        self._publish(alarm, at.t_ns)

    def _clear(self, alarm: AlarmInstance, at: Occasion) -> None:
        alarm.superseded = False
        before = alarm.occasion
        alarm.occasion = replace(at, onset_seq=before.onset_seq, text=before.text)
        if alarm.clear():
            self._publish(alarm, at.t_ns)
        else:
            self._note(alarm, at.t_ns)
        self._raise_unnamed(at.t_ns)

    def _refinements(self, alarm: AlarmInstance) -> list[AlarmInstance]:
        """Alarms that refine `alarm`."""
        return [other for other in self._alarms.values() if other.kind.refines == alarm.kind.name]

    def _named_by(self, alarm: AlarmInstance) -> AlarmInstance | None:
        """The standing alarm that `alarm` replaces."""
        coarse = self._alarms.get(alarm.kind.refines)
        return coarse if coarse and coarse.active and coarse.state != "normal" else None

    def _raise_unnamed(self, t_ns: int) -> None:
        """Raise a still active alarm again when no alarm that refines it is standing."""
        for name in REFINED:
            coarse = self._alarms.get(name)
            if not coarse or not (coarse.superseded and coarse.active):
                continue
            if not any(other.stands_for_fault for other in self._refinements(coarse)):
                coarse.superseded = False
                self._raise(coarse, replace(coarse.occasion, t_ns=t_ns))

    def _is_first(self, alarm: AlarmInstance) -> bool:
        if alarm.is_remark:
            return False
        return not any(
            other.state in UNSEEN for other in self._alarms.values() if other is not alarm
        )

    def _count(self, alarm: AlarmInstance, *, is_new: bool) -> None:
        """Count a raised alarm; begin a flood, or group the alarm in the current one."""
        if alarm.is_remark or alarm.name == ALARM_FLOOD:
            return
        t_ns = alarm.occasion.t_ns
        begins = is_new and self._flood.add(t_ns)
        alarm.grouped = self._flood.active and not alarm.kind.always_shown
        if begins:
            at = replace(
                alarm.occasion,
                value=float(self._flood.count),
                high=float(MOST_IN_WINDOW),
                low=float("nan"),
                text=f"first out was {self._first_out}" if self._first_out else "",
            )
            self._set(ALARM_FLOOD, at, active=True)

    def _advance(self, to_ns: int) -> None:
        """Process everything due by `to_ns` [ns]; looks for it only where something has changed."""
        if self._due_ns is None or to_ns < self._due_ns:
            return
        while due := [when for when in self._deadlines() if when[0] <= to_ns]:
            t_ns, name, end = min(due, key=lambda when: when[:2])
            end(self._alarm(name), t_ns)
        self._due_ns = min((when[0] for when in self._deadlines()), default=None)

    def _deadlines(self) -> list[Deadline]:
        """What ends by itself: when [ns], the alarm that it is about, and what ends it.

        A flood's alarm may also chatter: its series ends apart from the flood.
        """
        found: list[Deadline] = []
        if self._flood.ends_ns is not None:
            found.append((self._flood.ends_ns, ALARM_FLOOD, self._end_flood))
        for alarm in self._alarms.values():
            if alarm.shelved_until_ns:
                found.append((alarm.shelved_until_ns, alarm.name, self._end_shelf))
            if alarm.flaps.ends_ns is not None:
                found.append((alarm.flaps.ends_ns, alarm.name, self._end_series))
        return found

    def _end_shelf(self, alarm: AlarmInstance, t_ns: int) -> None:
        self._unshelve(alarm, t_ns, _SHELF_TIME_OVER)

    def _end_series(self, alarm: AlarmInstance, t_ns: int) -> None:
        """End a chattering series: the alarm follows its condition again."""
        if not alarm.active and alarm.clear():
            self._publish(alarm, t_ns)
        alarm.flaps.end()

    def _end_flood(self, flood: AlarmInstance, t_ns: int) -> None:
        self._flood.end()
        if flood.active:
            self._set(ALARM_FLOOD, Occasion(t_ns=t_ns), active=False)
        for alarm in self._alarms.values():
            if alarm.grouped:
                alarm.grouped = False
                self._publish(alarm, t_ns, Actor(text="shown again after the flood"))

    def _obey(self, alarm: AlarmInstance, command: AlarmCommand, actor: Actor) -> None:
        t_ns = command.t_ns
        if command.action == "shelve":
            self._shelve(alarm, t_ns, actor)
        elif command.action == "unshelve":
            self._unshelve(alarm, t_ns, actor)
        elif alarm.acknowledge() if command.action == "acknowledge" else alarm.reset():
            alarm.grouped = False
            self._publish(alarm, t_ns, actor)
            if alarm.name == ALARM_FLOOD and command.action == "acknowledge":
                self._acknowledge_group(t_ns, actor)

    def _acknowledge_group(self, t_ns: int, actor: Actor) -> None:
        """Acknowledge the alarms grouped in an acknowledged flood."""
        for alarm in self._alarms.values():
            if alarm.grouped and alarm.acknowledge():
                self._publish(alarm, t_ns, actor)

    def _shelve(self, alarm: AlarmInstance, t_ns: int, actor: Actor) -> None:
        alarm.shelved_until_ns, alarm.shelved_by = t_ns + SHELF_LIFE_NS, actor
        # Otherwise it would be raised from the shelf once no better name stands.
        alarm.superseded = False
        alarm.dismiss()
        self._publish(alarm, t_ns, actor)
        hours = SHELF_LIFE_NS // 3_600_000_000_000
        text = f"{alarm.name} shelved by {actor.user} for {hours} h: {actor.text}"
        self._tell("alarm_shelved", text, t_ns)

    def _unshelve(self, alarm: AlarmInstance, t_ns: int, actor: Actor) -> None:
        alarm.shelved_until_ns = 0
        why = actor.user or actor.text
        self._tell("alarm_unshelved", f"{alarm.name} taken off the shelf: {why}", t_ns)
        if alarm.active and alarm.settings.enabled:
            self._raise(alarm, replace(alarm.occasion, t_ns=t_ns))
        else:
            self._note(alarm, t_ns, actor)

    def _publish(self, alarm: AlarmInstance, t_ns: int, actor: Actor = NOBODY) -> None:
        self._note(alarm, t_ns, actor)
        if alarm.grouped:
            self._tell("alarm_grouped", f"{alarm.name} is {alarm.state}, grouped in a flood", t_ns)
        else:
            self._said.append(alarm.message(actor.user, t_ns, actor.identity))

    def _note(self, alarm: AlarmInstance, t_ns: int, actor: Actor = NOBODY) -> None:
        """Add a record for the journal."""
        self._changes.append(_record(alarm, t_ns, actor))

    def _tell(self, code: str, text: str, t_ns: int) -> None:
        self._said.append(Event(SOURCE, t_ns, "warning", code, text))

    def _take_announcements(self) -> list[Announcement]:
        said, self._said = self._said, []
        return said


def _record(alarm: AlarmInstance, t_ns: int | None, actor: Actor) -> AlarmRecord:
    return AlarmRecord(
        alarm.message(actor.user, t_ns, actor.identity), alarm.active, alarm.latched,
        alarm.shelved_until_ns, alarm.grouped, actor.text,
    )  # fmt: skip
