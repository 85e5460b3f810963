"""What people read: verdict, advice, status and log, for every situation that a rig can be in."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.dashboard.board.alarm_book import AlarmBook
from rigwatch.dashboard.board.facts import SILENCE, Facts
from rigwatch.dashboard.board.log_lines import alarm_level, alarm_line, gap_line
from rigwatch.dashboard.board.palette import VERDICTS
from rigwatch.dashboard.board.status import advice, status
from rigwatch.wire.bus import ShelvedAlarm
from rigwatch.wire.messages.message_types import (
    PROBABLY_MISSING,
    Alarm,
    EstimateBlock,
    Event,
    Gap,
    SampleBlock,
)
from tests.dashboard.rig_messages import MARKS, Rig

RIG = Rig()
STATES = ("normal", "unacknowledged", "acknowledged", "cleared_unacknowledged")
MESSAGES = list(RIG.messages(1.0))
SECOND = 1_000_000_000


def alarm(name: str, state: str = "unacknowledged", severity: str = "error") -> Alarm:
    raised = RIG.alarm(name, state, 100, f"the cause of {name}")
    return replace(raised, severity=severity)  # type: ignore[arg-type]


def moving(*alarms: Alarm, **figures: float) -> Facts:
    """A rig whose samples and estimates come, with these alarms and figures."""
    facts = Facts("bench", marks=MARKS, model="bench.toml")
    for message in MESSAGES:
        if isinstance(message, SampleBlock):
            facts.see_samples(message)
        elif isinstance(message, EstimateBlock):
            facts.see_estimates(message)
    for one in alarms:
        facts.book.record(one)
    facts.figures.update(figures)
    return facts


def headline(facts: Facts) -> str:
    return advice(facts).splitlines()[0]


@pytest.mark.parametrize(
    ("facts", "verdict", "head"),
    [
        (Facts("bench"), "waiting", "# Waiting for bench"),
        (moving(), "healthy", "# Healthy"),
        (moving(armed=0.0), "learning", "# Learning"),
        (moving(observable=0.0), "no_verdict", "# No verdict now"),
        (moving(alarm("dry_friction")), "dry_friction", "# DRY FRICTION"),
        (moving(alarm("dry_friction", "acknowledged")), "dry_friction", "# DRY FRICTION"),
        (moving(alarm("dry_friction", "normal")), "healthy", "# Healthy"),
        (
            moving(alarm("dry_friction", "cleared_unacknowledged")),
            "over",
            "# Cleared: dry friction",
        ),
        (moving(alarm("link", "cleared_unacknowledged")), "healthy", "# Healthy"),
        (moving(alarm("sensor_stuck.position")), "fault", "# SENSOR STUCK, POSITION"),
        (moving(alarm("not_observable", "acknowledged", "info")), "no_verdict", "# No verdict now"),
    ],
)
def test_first_line_is_the_verdict(facts: Facts, verdict: str, head: str) -> None:
    assert facts.verdict() == verdict
    assert headline(facts) == head


def test_the_worst_fault_leads_and_the_others_are_named() -> None:
    facts = moving(alarm("dry_friction"), alarm("link", severity="critical"))
    assert headline(facts) == "# LINK"
    assert "Also: dry friction." in advice(facts)


def test_what_to_do_comes_before_why() -> None:
    text = advice(moving(alarm("dry_friction")))
    assert text.index("Stop soon") < text.index("The cause of dry_friction")


def test_what_is_probably_missing_is_reported_until_the_alarm_comes_anew() -> None:
    facts = moving(alarm("dry_friction"))
    text = "dry_friction: probably missing: coulomb@load"
    facts.book.hear(Event("monitor", 0, "error", PROBABLY_MISSING, text))
    assert "Probably missing: coulomb@load." in advice(facts)
    facts.book.record(alarm("dry_friction", "acknowledged"))
    assert "Probably missing" in advice(facts)
    facts.book.record(replace(alarm("dry_friction"), onset_seq=5000))
    assert "Probably missing" not in advice(facts)


def test_estimates_stand_beside_thresholds_and_signature() -> None:
    text = advice(moving(theta1=0.93))
    assert "| Coulomb θ1 | 0.93 | -0.1 … 0.1 | 1 |" in text


def test_silence_is_reported_and_ends() -> None:
    facts = moving()
    now = RIG.start_ns + SECOND
    facts.tell_time(now)
    facts.tell_time(now + round((SILENCE + 1.0) * SECOND))
    assert facts.verdict() == "stale"
    assert headline(facts) == "# NO SAMPLES"
    facts.see_samples(next(m for m in MESSAGES if isinstance(m, SampleBlock)))
    facts.tell_time(now + 4 * SECOND)
    assert facts.verdict() == "healthy"


def later(seconds: float) -> list[SampleBlock | EstimateBlock]:
    """Samples and estimates of a rig that goes on for that long."""
    went_on = replace(RIG, start_ns=RIG.start_ns + SECOND)
    return [m for m in went_on.messages(seconds) if isinstance(m, SampleBlock | EstimateBlock)]


@pytest.mark.parametrize("live", [True, False], ids=["live", "recorded"])
def test_samples_that_nobody_judges_are_not_called_healthy(live: bool) -> None:
    facts = moving()
    now = RIG.start_ns + SECOND
    facts.tell_time(now if live else None)
    samples = [m for m in later(SILENCE + 1.0) if isinstance(m, SampleBlock)]
    for block in samples:
        facts.see_samples(block)
        facts.tell_time(int(block.t_ns[-1]) if live else None)
    assert facts.verdict() == "unwatched"
    assert headline(facts) == "# NOT WATCHED"
    assert "for 3 s no estimate" in advice(facts)
    assert "armed" not in status(facts)
    assert "Coulomb" not in advice(facts)
    for message in later(0.1):
        if isinstance(message, EstimateBlock):
            facts.see_estimates(message)
    facts.tell_time(now + 3 * SECOND if live else None)
    facts.see_samples(samples[-1])
    assert facts.verdict() == "healthy"


def test_a_screen_that_draws_late_draws_all_samples_before_their_estimates() -> None:
    facts, now = moving(), RIG.start_ns + SECOND
    facts.tell_time(now)
    found = later(2.0 * SILENCE)
    for kind, see in ((SampleBlock, facts.see_samples), (EstimateBlock, facts.see_estimates)):
        for message in found:
            if isinstance(message, kind):
                see(message)  # type: ignore[operator]
            assert facts.verdict() == "healthy"
    facts.tell_time(now + round(2.0 * SILENCE * SECOND))
    assert facts.verdict() == "healthy"


def test_a_slow_device_is_watched_between_two_of_its_samples() -> None:
    facts, far = moving(), 10 * SECOND
    for count in range(1, 5):
        at = RIG.start_ns + count * far
        block = next(m for m in MESSAGES if isinstance(m, SampleBlock))
        facts.see_samples(replace(block, t_ns=block.t_ns - block.t_ns[-1] + at))
        assert facts.verdict() == "healthy"
        facts.see_estimates(next(m for m in MESSAGES if isinstance(m, EstimateBlock)))


def test_age_of_the_picture() -> None:
    facts = moving()
    newest = int(RIG.t_ns(np.array(255)))
    facts.tell_time(newest + 40_000_000)
    assert facts.age.now == pytest.approx(40.0)
    assert "| age of newest sample [ms] | 40 | 40 | 40 |" in status(facts)


def test_shelved_alarms_are_told_with_whom_and_until_when() -> None:
    facts = moving()
    facts.shelf = [ShelvedAlarm("departure", RIG.start_ns, "ann", "proved", "new seal", True)]
    (line,) = [one for one in status(facts).splitlines() if "shelved" in one]
    assert line.startswith("* shelved until 20")
    assert line.endswith("by ann (proved): departure, its condition holds: new seal")


def test_status_shows_what_people_ask_for_first() -> None:
    facts = moving()
    facts.health["daq"] = RIG.health(10)
    rows = [line for line in status(facts).splitlines() if line.startswith("| ")][1:]
    assert rows[0] == "| rate [Hz] | 256 | 256 | 255.4 |"
    assert [row.split("|")[1].strip() for row in rows] == [
        "rate [Hz]",
        "lost samples",
        "CRC errors",
        "latency [ms]",
    ]


def test_status_passes_on_complaints() -> None:
    facts = moving()
    facts.health["daq"] = replace(RIG.health(10), state="slow", text="200 samples a second")
    facts.skipped = 3
    assert "* daq: slow, 200 samples a second" in status(facts)
    assert "skipped 3 messages" in status(facts)


def test_log_line_has_guidance_value_and_sample() -> None:
    line = alarm_line(alarm("dry_friction"))
    assert line.startswith("dry friction: ALARM — Stop soon.")
    assert "value 0.93, below 0.5 expected, sample 100" in line
    assert alarm_level(alarm("dry_friction")) == "ERROR"
    assert alarm_level(alarm("dry_friction", "acknowledged")) == "INFO"


def test_log_line_names_who_acted() -> None:
    acted = replace(alarm("dry_friction", "acknowledged"), user="ada")
    assert alarm_line(acted) == "dry friction: alarm, acknowledged by ada"


def test_gap_lines() -> None:
    gap = Gap("rig", 1, 10, 19, 0, "monitor", "not in the ring")
    assert gap_line(gap) == "monitor: rig: 10 samples lost from 10 on: not in the ring"
    assert "number unknown" in gap_line(replace(gap, last=9))


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["dry_friction", "departure", "link", "sensor_spike.voltage", "new"]),
            st.sampled_from(STATES),
            st.sampled_from(["info", "warning", "error", "critical"]),
        )
    )
)
def test_any_course_of_alarms_has_a_verdict(course: list[tuple[str, str, str]]) -> None:
    facts, last = moving(), {}
    for name, state, severity in course:
        facts.book.record(alarm(name, state, severity))
        last[name] = (state, severity)
    standing = {
        name
        for name, (state, severity) in last.items()
        if state in STATES[1:3] and severity != "info"
    }
    assert facts.verdict() in VERDICTS
    assert {fault.name for fault in facts.book.faults()} == standing
    assert (facts.verdict() == "healthy") <= (not standing)
    assert advice(facts).startswith("# ")


def test_recording_tells_whether_the_state_changed() -> None:
    book = AlarmBook()
    assert book.record(alarm("link"))
    assert not book.record(alarm("link"))
    assert book.record(alarm("link", "acknowledged"))
