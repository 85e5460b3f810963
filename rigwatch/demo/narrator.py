"""Narrates the demonstration.

It reports what is done to the rig, which the monitor does not know, the monitor's alarms, and what
the monitor finds to be missing in its model.
"""

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from math import inf, isinf
from textwrap import wrap

from rigwatch.demo.verdict import ALARM
from rigwatch.wire.messages import PROBABLY_MISSING, Alarm, EstimateBlock, Event
from sim_plant.scenario import Scenario

ACTS = {
    "coulomb": ("dry friction of {value:g} N begins", "the friction ends"),
    "actuator_gain": (
        "the valve's gain falls to {value:.0%}, which makes no difference near 0 V",
        "the valve's gain is whole again",
    ),
}
WHERE_TO_LOOK = (
    "on the dashboard, watch the verdict and the residual: measured minus modelled acceleration;",
    "its change, drawn in the same plot, stays between the red limits while the rig is healthy",
    "each fault raises two alarms: that something has changed, and then what it is",
)
NEUTRAL = {"coulomb": 0.0, "actuator_gain": 1.0}
CAUSE_FOLLOWS = (
    "what is missing in the rig's model follows: every known effect is compared with two seconds",
    "of samples, which takes some seconds, and up to a minute the first time or on a busy machine",
)
SIZE = "theta1"
"""The monitor's estimate of dry friction, in units of that which it was commissioned with."""
SIZED_AFTER = 2.0
"""Time from the naming of dry friction to the estimate of its size that is told [s]."""
_STATEMENTS = re.compile(r"(\w+@\w+) (\(.*?\)): (explains [^;]*)(?:;(.*))?", re.DOTALL)
WIDTH = 88
"""Longest line of a statement, without its margin [characters]."""
ENDED = ("normal", "cleared_unacknowledged")
NAMELESS, UNKNOWN = "departure", "other_fault"
"""The alarm that reports a fault without naming it."""
AFTER_EXPLAINED = 8.0
"""Time from the naming of dry friction to the end if its cause is told by then [s]."""
NAMED = {NAMELESS: "alarm raised", UNKNOWN: "dry friction ruled out"}
"""What an alarm tells at its time, if that is not the fault's name."""
OF_THE_RIG = (NAMELESS, "dry_friction", "stiction", UNKNOWN)
"""Alarms that answer to what is done to the rig; others are about its measuring chain."""
OF_THE_CHAIN = (
    "(about the measuring chain, and none of the faults announced: on a busy machine the simulated",
    "device falls behind; further alarms of this kind are counted, and told on the dashboard)",
)


@dataclass(frozen=True, slots=True)
class Act:
    """A change to the simulated rig.

    Attributes:
        seq: its sample.
        begins: whether a fault begins with it.
        text: a description.
        played: how often the scenario has been played before.
    """

    seq: int
    begins: bool
    text: str
    played: int = 0


def acts(scenario: Scenario) -> Iterator[Act]:
    """All changes to the rig, cycle by cycle; endless if the scenario repeats."""
    rate, cycle, played = scenario.plant.sample_rate, 0.0, 0
    while scenario.events:
        for event in sorted(scenario.events, key=lambda event: event.at_s):
            words = f"{event.effect} becomes {{value:g}}"
            begins, ends = ACTS.get(event.effect, (words, words))
            faulty = event.value != NEUTRAL.get(event.effect)
            text = begins if faulty else ends
            seq = round((cycle + event.at_s) * rate)
            yield Act(seq, faulty, text.format(value=event.value), played)
        if not scenario.cycle_s:
            return
        cycle, played = cycle + scenario.cycle_s, played + 1


def in_lines(found: str) -> list[str]:
    """What is probably missing, by statement: effect, physics, how well it explains, rivals."""
    parts = _STATEMENTS.fullmatch(found)
    return [part.strip() for part in parts.groups() if part] if parts else [found]


class Narrator:
    """Reports the changes as the samples reach them, and the alarms as they arrive.

    Args:
        scenario: the changes to the rig.
        say: called with each line.
        rig: the rig's configuration, for the commands that people are told.
        studies: folder of the studies that the workbench makes of alarms.
        known: the dry friction that the monitor was commissioned with [N].
        attended: people watch, so commands that a running rig answers are told.
        workbench: gives the address of the workbench, empty without one.

    Attributes:
        alarms: raised so far.
        explained: whether the monitor has said what its model lacks.
    """

    def __init__(
        self,
        scenario: Scenario,
        say: Callable[[str], None],
        rig: str,
        studies: str = "",
        *,
        known: float,
        attended: bool = True,
        workbench: Callable[[], str] = str,
    ) -> None:
        self.alarms: list[Alarm] = []
        self.explained = False
        self._attended, self._known = attended, known
        self._size, self._sized_at = 0.0, inf
        self._say, self._config, self._studies = say, rig, studies
        self._workbench = workbench
        self._rate, self._cycle_s = scenario.plant.sample_rate, scenario.cycle_s
        self._acts = acts(scenario)
        self._next = next(self._acts, None)
        self._last: Act | None = None
        self._ended: Alarm | None = None
        self._unnamed: Alarm | None = None
        self._told, self._untold = set[str](), 0

    def samples(self, seq: int) -> None:
        """Report the changes up to this sample."""
        while self._next is not None and seq >= self._next.seq:
            self._last = self._next
            self._say(f"{self._time(self._last.seq)} the rig: {self._last.text}")
            self._next = next(self._acts, None)
            if not self._last.begins:
                self._announce("next", self._last.seq)

    @property
    def fault_begun(self) -> bool:
        """Whether the first fault has begun."""
        return self._last is not None

    def all_told_at(self, after_named: float) -> float:
        """Rig time at which a run that nobody watches may end [s].

        Args:
            after_named: longest time from the naming of dry friction; infinite for a run that is
                watched [s].
        """
        named = [alarm.seq for alarm in self.alarms if alarm.name == ALARM]
        if not named or isinf(after_named):
            return inf
        return named[0] / self._rate + (AFTER_EXPLAINED if self.explained else after_named)

    def begin(self, seq: int) -> None:
        """Say that faults are planned, and how long after this sample the first comes."""
        if self._next is not None:
            again = f", every {self._cycle_s:g} s until you end it" if self._cycle_s else ""
            self._say(f"            the demo puts faults into the rig and takes them out{again}")
            if self._attended:
                for line in WHERE_TO_LOOK:
                    self._say(f"            {line}")
        self._announce("first", seq)

    def _announce(self, which: str, seq: int) -> None:
        """Say how long after this sample a fault comes; nothing if none does."""
        if self._next is not None and self._next.begins:
            wait = (self._next.seq - seq) / self._rate
            again = self._last is not None and self._next.played > self._last.played
            if again:
                self._say("            that was the last of them, and they begin again:")
            which = "first" if again else which
            self._say(f"            the {which} fault comes in {wait:.0f} s; Ctrl-C ends the demo")

    def judged(self, block: EstimateBlock) -> None:
        """Take estimates, and report the end of an alarm a second of samples before them.

        The monitor may lag behind the samples, and a name that follows a departure with it.
        """
        seq = block.seq + len(block)
        # Its explanation may come after the friction has ended.
        if seq <= self._sized_at:
            self._size = float(block.column(SIZE).values[-1])
        if self._ended is not None and seq > self._ended.seq + self._rate:
            self._tell_end()

    def alarm(self, alarm: Alarm) -> None:
        """Report a change of an alarm."""
        if alarm.seq >= 0:
            self.samples(alarm.seq)
        if alarm.state == "unacknowledged":
            if self._ended is not None and alarm.onset_seq <= self._ended.onset_seq:
                self._ended = None  # the fault persists, under its name
            self._tell(alarm)
            self.alarms.append(alarm)
            if alarm.name == ALARM:
                self._sized_at = alarm.seq + SIZED_AFTER * self._rate
        elif alarm.name in self._told and alarm.state in ENDED:
            self._tell_end()
            self._ended = alarm
            if alarm.name != NAMELESS:
                self._tell_end()

    def end(self) -> None:
        """Say how many alarms have not been told."""
        if self._untold:
            self._say(f"alarms about the measuring chain that were not told: {self._untold}")

    def _tell(self, alarm: Alarm) -> None:
        """Report an alarm; of those about the measuring chain only the first."""
        of_the_chain = alarm.name not in OF_THE_RIG
        if of_the_chain and self._told - set(OF_THE_RIG):
            self._untold += 1
            return
        self._say(f"{self._time(alarm.seq)} ALARM: {alarm.cause}{self._delay(alarm)}")
        if not of_the_chain:
            self._tell_whose_name(alarm)
        for line in OF_THE_CHAIN if of_the_chain else ():
            self._say(f"            {line}")
        self._advise(alarm)
        self._told.add(alarm.name)

    def _tell_whose_name(self, alarm: Alarm) -> None:
        """Say that an alarm names the fault of an earlier one, or that its name may follow."""
        if alarm.name == NAMELESS and NAMELESS not in self._told:
            self._say("            (something has changed; what it is follows as a second alarm)")
        if alarm.name != NAMELESS and self._unnamed is not None:
            names = "tells that no dry friction is" if alarm.name == UNKNOWN else "names the fault"
            self._say(f"            (this {names} behind {self._called(self._unnamed)})")
        self._unnamed = alarm if alarm.name == NAMELESS else None

    def _advise(self, alarm: Alarm) -> None:
        """Say once for each name what to do, and once where all alarms are listed."""
        if alarm.name not in self._told:
            self._say(f"            what to do: {alarm.guidance_for(self._config)}")
        if alarm.name in OF_THE_RIG and not self._told & set(OF_THE_RIG):
            for line in CAUSE_FOLLOWS:
                self._say(f"            {line}")
            if self._attended and (address := self._workbench()):
                self._say(f"            the workbench, to study alarms in a browser: {address}")
        if self._attended and alarm.name != NAMELESS and self._told <= {NAMELESS}:
            self._say(f"            all alarms: $ rigwatch alarms {self._config}")
            self._say("            (an alarm is kept, even once its cause has gone, until somebody")
            self._say("            has said that it was seen: rigwatch ack)")

    def explain(self, event: Event) -> None:
        """Report which effect the monitor finds to be missing in its model since an alarm."""
        if event.code == PROBABLY_MISSING:
            self.explained = True
            found = event.text.rpartition("probably missing: ")[2]
            first, *more = in_lines(found)
            whose = self._whose(event)
            self._say(f"            {whose}probably missing in the rig's model: {first}")
            for line in more:
                for part in wrap(line, WIDTH):
                    self._say(f"              {part}")
            alarm = self._newest(OF_THE_RIG)
            newest = alarm.name if alarm else ""
            # An explanation bears the name of the first alarm, which is mostly a departure.
            if newest == ALARM or event.text.startswith(ALARM):
                force, times = f"{self._size * self._known:.2f} N", f"{self._size:.2f} times"
                self._say(f"            measured friction: {force}, {times} that of the recording")
                self._say("            with known friction, from which its model was made")
            effect = re.search(r"(\w+)@(\w+)", found)  # an effect at a port: effect@port
            if effect:
                self._say(f"            more about it: $ rigwatch effects {effect[1]}")
                self._tell_how_to_study(newest or ALARM, effect[1], effect[2])

    def _whose(self, event: Event) -> str:
        """Which alarm an explanation belongs to: others may have come since."""
        alarm = self._newest((event.text.partition(": ")[0],))
        return f"{self._called(alarm)}: " if alarm else ""

    def _newest(self, names: Collection[str]) -> Alarm | None:
        """The newest alarm of one of these names."""
        return next((one for one in self.alarms[::-1] if one.name in names), None)

    def _called(self, alarm: Alarm) -> str:
        return f"the alarm of {alarm.seq / self._rate:.2f} s"

    def _tell_how_to_study(self, alarm: str, effect: str, port: str) -> None:
        """Say how the effect's strength is found, and how the model gets it."""
        if not (self._attended and self._studies):
            return
        study = f"{self._studies}/{alarm}-*"
        self._say(
            "            next, how strong it is (the demo goes on meanwhile): Open as a study,"
        )
        address = self._workbench()
        where = f"the workbench ({address})" if address else "the workbench"
        self._say(f"            at the alarm in {where},")
        self._say("            which makes its folder; explain and add it there, or by commands:")
        self._say(f"              $ rigwatch explain {study}")
        self._say(f"              $ rigwatch add {study} {effect} --port {port}")

    def _tell_end(self) -> None:
        """Report the end of an alarm; that of a departure only if no named fault replaced it."""
        if self._ended is not None:
            name = self._ended.name
            if name == NAMELESS:
                self._unnamed = None
            what = name.replace("_", " ") if name in OF_THE_RIG else self._ended.cause
            self._say(f"{self._time(self._ended.seq)} {what}: the condition has gone")
            self._tell_how_to_acknowledge(self._ended)
            self._ended = None

    def _tell_how_to_acknowledge(self, ended: Alarm) -> None:
        """Say that an alarm stands until somebody has seen it, and the command for that."""
        if self._attended and ended.state == "cleared_unacknowledged":
            self._say("            the alarm is kept until somebody says that it was seen:")
            self._say("            (try it in another terminal: the demo goes on meanwhile)")
            self._say(f"              $ rigwatch ack {self._config} {ended.name}")

    def _delay(self, alarm: Alarm) -> str:
        if self._last is None or alarm.seq < self._last.seq or alarm.name not in OF_THE_RIG:
            return ""
        late = alarm.seq - self._last.seq
        onset = max(0, alarm.onset_seq - self._last.seq)
        told = NAMED.get(alarm.name, "named")
        return (
            f" (first sign {onset / self._rate * 1e3:.0f} ms after the fault began, "
            f"{told} at {late / self._rate * 1e3:.0f} ms)"
        )

    def _time(self, seq: int) -> str:
        return f"{seq / self._rate:8.2f} s " if seq >= 0 else " " * 10 + " "
