"""A year in an hour: a supervised rig by a fast clock, with a planned year of sessions.

    rigwatch up ─▶ router, plant, daq, monitor, recorder, witness ─┐ all by `fast_clock.c`
    control room: a listener and operator ─────────────────────────┘
         ▲ this process: the clock, the plan, faults, kills; memory and disk after each session

A thousand sessions of 25 s spread over the year, at fourteen times the machine's pace; between two
of them the rig is switched off and the machine sleeps for hours, so that Unix time steps. Midnight,
both changes of daylight saving time, a leap second and the turn of the year lie within sessions.
Recordings of earlier years fill the 2 GB that the recording may use, so that each new one takes the
place of old ones: by size at first, by age once enough of them are old. The journal, too, is one of
earlier years.
"""

import contextlib
import os
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from benchmarks.processes.live_rig import LiveRig, live_rig
from benchmarks.year import account
from benchmarks.year.account import Reason
from benchmarks.year.calendar import AT_S, FOR_S, RUNNING_S, SESSIONS, Session, year
from benchmarks.year.earlier_years import journal_of_years, recordings_of_years
from benchmarks.year.rig_of_the_year import PROCESSES, RigOfTheYear
from tools.benchmark_table import Row
from tools.memory_series import Memory

RATE = 14.0
LIMIT_BYTES, SMALLEST = 2e9, 2e6
"""What the recording may use in a year, a part of it in a part of a year, and its least [bytes]."""
BETWEEN_CHECKS = 100e6 / 60.0
"""What is recorded between two looks at the size, a minute of 100 MB an hour [bytes]."""
DAYS, ALARM_DAYS = 450.0, 900.0
"""Ages at which recordings are removed, those with alarms later [days]."""
MEMORY_PERCENT = 2.0
HOUR_S = 3600.0
IN_MEMORY = Path("/dev/shm")
"""Where the disk does not set the pace: it is no faster than usual."""
STALE_S = 0.5
"""Silence of the device that is told, as in the demonstration [s of the machine]: pauses of a busy
machine, 70 to 140 ms long, are a second by a fast clock and no fault of the rig."""
UNWATCHED_S = 0.125
"""The same of the monitor's silence, which the witness tells [s of the machine]."""
LOOK_S = 5.0
"""Time from switching the rig on until the operator looks [s]."""
OFF_S = 2.0
"""Time from switching the rig off to the machine's sleep [s]."""


class Year:
    """One run: what was planned to happen is noted as reasons of alarms."""

    def __init__(self, rig: RigOfTheYear) -> None:
        self.rig, self.clock = rig, rig.clock
        self.reasons: list[Reason] = []
        self.memory, self.largest = Memory(), 0
        self.gone: list[str] = []
        self._off_since = self.clock.wall_ns()

    def run(self, session: Session) -> None:
        """From the jump to its beginning until it is switched off."""
        self._switch_on(session)
        began = self.clock.now_s()
        self.clock.wait(LOOK_S)
        self._put_right()
        self.clock.wait(began + AT_S - self.clock.now_s())
        if session.leap:
            self.clock.step_wall(-1.0)
        if session.fault or session.killed:
            self._happen(session)
        self.clock.wait(began + RUNNING_S - self.clock.now_s())
        self._put_right()
        self._look(session)
        self._off_since = self.clock.wall_ns()
        self.rig.ask("fault unplug")
        self.clock.wait(OFF_S)

    def end(self) -> None:
        """The rig stays switched off."""
        off = self._off_since, self.clock.wall_ns()
        self.reasons.append(Reason(-1, "switched off", *off, account.LINK))

    def _switch_on(self, session: Session) -> None:
        self.clock.step_wall(max(0.0, session.begin - self.clock.wall_ns() * 1e-9))
        self.rig.ask("heal")
        self.rig.ask("restart")
        self.clock.wait(60.0, lambda: self.rig.lag_s() < 0.5)
        off = self._off_since, self.clock.wall_ns()
        self.reasons.append(Reason(session.index, "switched off", *off, account.LINK))

    def _put_right(self) -> None:
        """The operator acknowledges and resets what stands."""
        if self.rig.standing():
            self.rig.operate("acknowledge", "reset")

    def _happen(self, session: Session) -> None:
        begin = self.clock.wall_ns()
        fault = session.fault
        if fault is None:
            self.rig.kill(session.killed)
            self.clock.wait(5.0)
            if not self.rig.recovered():
                self.gone.append(f"{session.killed} of session {session.index}")
            reason = Reason(
                session.index, session.note, begin, 0, account.KILL, _told(session.killed)
            )
        else:
            self.rig.ask(fault.begin)
            self.clock.wait(FOR_S)
            self.rig.ask(fault.end)
            names = (*fault.told, *fault.also)
            reason = Reason(session.index, session.note, begin, 0, names, fault.told)
        self.reasons.append(replace(reason, end_ns=self.clock.wall_ns()))

    def _look(self, session: Session) -> None:
        self.memory.look({name: self.rig.pid(name) for name in PROCESSES}, time.monotonic())
        self.largest = max(self.largest, _folder_bytes(self.rig.rig.folder / "sessions"))
        if session.index % 10 == 0:
            print(f"session {session.index}: {self.largest / 1e6:.1f} MB", file=sys.stderr)


def _folder_bytes(folder: Path) -> int:
    """Size of all files in a folder [bytes]; files and folders may be removed meanwhile."""
    total = 0
    for within, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):
                total += Path(within, name).stat().st_size
    return total


def _told(name: str) -> tuple[str, ...]:
    return ("monitor_stale",) if name == "monitor" else ()


def run(quick: bool) -> list[Row]:
    """Eight sessions, or as many as RIGWATCH_YEAR_SESSIONS says (default 1000, about an hour).

    After RIGWATCH_YEAR_MINUTES it ends with those that it has run. RIGWATCH_YEAR_FOLDER, which must
    not exist, is where the rig's files are kept, with each process's memory after each session.
    """
    kept = os.environ.get("RIGWATCH_YEAR_FOLDER")
    if kept:
        Path(kept).mkdir()  # refused before the hour, not after it
    count = 8 if quick else int(os.environ.get("RIGWATCH_YEAR_SESSIONS", str(SESSIONS)))
    until = time.monotonic() + 60.0 * float(os.environ.get("RIGWATCH_YEAR_MINUTES", "inf"))
    if IN_MEMORY.is_dir():
        os.environ["TMPDIR"] = tempfile.tempdir = str(IN_MEMORY)
    with live_rig() as rig:
        limit = max(SMALLEST, LIMIT_BYTES * count / SESSIONS)
        _configure(rig, limit)
        recordings_of_years(rig.folder / "sessions", rig.config.rig.id, limit)
        journal_of_years(rig.folder / "alarms.jsonl")
        with RigOfTheYear(rig, RATE) as processes:
            done, began = Year(processes), time.monotonic()
            for session in year(count):
                done.run(session)
                if time.monotonic() > until:
                    break
            done.end()
            ran = "" if session.index + 1 == count else f"{session.index + 1} of "
            what = f"a year, {ran}{count} sessions"
            rows = [*_rows(done, what, limit), _by_the_clock(what, time.monotonic() - began)]
        if kept:
            ignored = shutil.ignore_patterns("serial-line")
            shutil.copytree(rig.folder, kept, ignore=ignored, dirs_exist_ok=True)
            done.memory.write(Path(kept, "memory.csv"))
    return rows


def _by_the_clock(what: str, took_s: float) -> Row:
    hour = f"{HOUR_S / 60:.0f} min"
    return Row(f"{what}: by the clock", f"{took_s / 60:.0f} min", hour, "", "", took_s <= HOUR_S)


def _configure(rig: LiveRig, limit: float) -> None:
    text = rig.path.read_text(encoding="utf-8")
    text = text.replace("scenarios/demo.toml", "scenarios/friction_free_day.toml")
    settings = {
        "segment": RUNNING_S,
        "keep_gigabytes": limit / 1e9,
        "keep_days": DAYS,
        "keep_alarm_days": ALARM_DAYS,
    }
    for key, value in settings.items():
        text = _with(text, "recorder", key, value)
    text = _with(text, "daq", "stale_after", STALE_S * RATE)
    witness = f"\n[witness]\nstale_after = {UNWATCHED_S * RATE}\n"
    rig.path.write_text(text + witness, encoding="utf-8")


def _with(text: str, section: str, key: str, value: float) -> str:
    kept = [line for line in text.splitlines() if not line.startswith(f"{key} =")]
    at = kept.index(f"[{section}]") + 1
    return "\n".join([*kept[:at], f"{key} = {value}", *kept[at:]])


def _rows(done: Year, what: str, limit: float) -> list[Row]:
    alarms = account.raised(done.rig.alarms())
    false = account.without_reason(alarms, done.reasons)
    faults = [reason for reason in done.reasons if reason.told]
    untold = account.untold(alarms, faults)
    unwritten, rotated = account.missing_in_journal(alarms, done.rig.rig.folder / "alarms.jsonl")
    most = limit + BETWEEN_CHECKS
    return [
        Row(f"{what}: alarms without a reason", f"{len(false)}", "0", "",
            f"{len(alarms)} alarms; {_examples(false)}", passed=not false),
        Row(f"{what}: faults told", f"{len(faults) - len(untold)} of {len(faults)}", "all", "",
            "; ".join(f"{u.what} of session {u.session}" for u in untold[:5]), passed=not untold),
        *[_memory_row(what, done, name) for name in PROCESSES],
        Row(f"{what}: disk", f"{done.largest / 1e6:.1f} MB", f"{most / 1e6:.1f} MB", "",
            f"limit {limit / 1e6:.1f} MB, looked at once a minute; the clock stood "
            f"{done.clock.stood_s:.0f} s", passed=done.largest <= most),
        Row(f"{what}: alarms missing in the journal", f"{unwritten}", "0", "",
            f"rotated {rotated} times", passed=unwritten == 0 and rotated > 0),
        _alive(what, done),
    ]  # fmt: skip


def _memory_row(what: str, done: Year, name: str) -> Row:
    """The growth by the hour of the run and by the year of the plan: the larger of them counts.

    An hour of a run that takes longer has less of the year in it, and memory grows with what a
    process does.
    """
    found, late = done.memory.growth(name), done.memory.growth(name, 0.25)
    of_year = len(done.memory.seen[name]) / max(1, found.looks)
    an_hour, a_year = found.an_hour, found.percent * of_year
    steps = done.memory.steps(name)
    when = ", ".join(f"{kb / 1e3:.1f} MB at {look}" for look, kb in steps[-4:])
    return Row(
        f"{what}: memory of {name}",
        f"{an_hour:+.2f} % an hour, {a_year:+.2f} ± {found.unsure * of_year:.2f} % a year",
        f"{MEMORY_PERCENT:g} %, both",
        "",
        f"{found.percent:+.2f} % over {found.looks} sessions, {late.percent:+.2f} % over the last "
        f"{late.looks}, {found.mb:.1f} MB at the end; {len(steps)} steps"
        + (f", the last {when}" if when else ""),
        passed=max(an_hour, a_year) <= MEMORY_PERCENT,
    )


def _alive(what: str, done: Year) -> Row:
    planned = sum(reason.what.endswith("killed") for reason in done.reasons)
    endings = [one for one in done.rig.endings if one["event"] in ("ended", "ill")]
    unplanned = [one for one in endings if not one["text"].startswith("ended by SIGKILL")]
    left = [f"{name} is missing at the end" for name in PROCESSES if not done.rig.alive(name)]
    note = "; ".join([*done.gone, *left, *(f"{e['process']} {e['text']}" for e in unplanned[:4])])
    return Row(f"{what}: processes that ended by themselves", f"{len(endings) - planned}", "0", "",
               note, passed=len(endings) == planned and not left and not done.gone)  # fmt: skip


def _examples(alarms: list[dict[str, object]]) -> str:
    return "; ".join(f"{a['name']} at {a['t']}: {a['text']}"[:80] for a in alarms[:6])
