"""The table of alarms: complete, consistent, and its settings reach the alarms."""

import numpy as np
import pytest

from monitor.alarms import ALARM_KINDS, AlarmManager, SensorFlags, check_settings
from monitor.alarms.kinds import kind_of, settings_of
from monitor.signals.conditions import CONDITION_KINDS
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.rig_config import AlarmSection
from tests.alarms.alarm_signals import condition, run, spell

NAMES = {kind.name for kind in ALARM_KINDS}


def test_every_condition_of_the_pipeline_has_an_alarm():
    assert {kind.name for kind in CONDITION_KINDS} <= NAMES


def test_names_are_unique_and_refinements_exist():
    assert len(NAMES) == len(ALARM_KINDS)
    assert {kind.refines for kind in ALARM_KINDS} - {""} <= NAMES


@pytest.mark.parametrize("kind", ALARM_KINDS, ids=lambda kind: kind.name)
def test_texts_say_what_is_wrong_and_what_to_do(kind):
    assert len(kind.cause) > 10
    assert kind.guidance.endswith(".")
    assert kind.cause.format(channel="position")


def test_a_misspelt_alarm_in_the_configuration_is_refused():
    with pytest.raises(ConfigError, match=r"rig\.toml: monitor\.alarms\.dry_fricton.*dry_friction"):
        check_settings({"dry_fricton": AlarmSection()}, "rig.toml")


def test_a_section_changes_only_what_it_says():
    settings = settings_of("gap", {"gap": AlarmSection(latch=True)})
    defaults = kind_of("gap").defaults
    assert settings.latch
    assert (settings.persistence, settings.clear_after) == (
        defaults.persistence,
        defaults.clear_after,
    )


def test_a_channels_own_section_goes_before_its_kinds():
    sections = {
        "sensor_stuck": AlarmSection(persistence=5),
        "sensor_stuck.position": AlarmSection(persistence=9),
    }
    assert settings_of("sensor_stuck.position", sections).persistence == 9
    assert settings_of("sensor_stuck.voltage", sections).persistence == 5


def test_a_condition_that_is_not_listed_is_still_a_plain_alarm():
    (alarm,) = run(AlarmManager(), [condition("odd_noise", spell(20, (5, 20)))])
    assert (alarm.name, alarm.severity, alarm.cause) == ("odd_noise", "warning", "odd noise")


def test_quality_flags_become_an_alarm_of_their_channel():
    n = 40
    flags = np.zeros(n, np.uint8)
    flags[10:30] = quality.SATURATED | quality.RESAMPLED
    clean = np.zeros(n, np.uint8)
    channels = (
        Column("voltage", "V", np.linspace(0, 1, n), clean),
        Column("position", "m", np.linspace(0, 2, n), flags),
        Column("bare", "m", np.zeros(n)),
    )
    t_ns = np.arange(n, dtype=np.int64)
    block = SampleBlock("rig", 7, 0, t_ns, t_ns, channels)
    (alarm,) = AlarmManager().update("rig", 7, 0, t_ns, SensorFlags(256.0).update(block))
    assert (alarm.name, alarm.seq, alarm.onset_seq) == ("sensor_saturated.position", 10, 10)
    assert "position" in alarm.cause
    assert alarm.value == pytest.approx(channels[1].values[10])
