"""A wrong configuration is told in one line: file, line, key, found, expected."""

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig, load_rig, section_or_error
from rigwatch.wire.typed_files.loading import load, parse

GOOD = """[rig]
id = "bench1"

[[channels]]
name = "voltage"
unit = "V"
gain = 3e-4

[[channels]]
name = "position"
unit = "m"
gain = 1e-6

[daq.device]
adapter = "serial"
port = "/dev/ttyUSB0"

[monitor]
model = "model.toml"

[monitor.alarms.dry_friction]
persistence = 2
"""

MISTAKES = [
    ("persistence", "persistance", "rig.toml:22: monitor.alarms.dry_friction.persistance: found an"
     " unknown key, expected 'persistence'"),
    ("persistence = 2", "persistence = 0", "rig.toml:22: monitor.alarms.dry_friction.persistence:"
     " found 0, expected a whole number >= 1"),
    ("gain = 1e-6", 'gain = "a"', "rig.toml:12: channels[1].gain: found 'a', expected a number"),
    ('id = "bench1"', "", "rig.toml:1: rig.id: found no value, expected one: it is required"
     " (the rig's name on the bus)"),
    ('id = "bench1"', 'id = "a b"', "rig.toml:2: rig.id: found 'a b', expected text matching"
     " '^[A-Za-z0-9_-]+$'"),
    ('"serial"', '"serail"', "rig.toml:15: daq.device.adapter: found 'serail', expected one of"
     " modbus-rtu, modbus-tcp, plugin, replay, serial"),
    ("port", "prot", "rig.toml:16: daq.device.prot: found an unknown key, expected 'port'"),
    ("[monitor]", "[monitro]", "rig.toml:18: monitro: found an unknown key, expected 'monitor'"),
    ('model = "model.toml"', 'model = 3', "rig.toml:19: monitor.model: found 3, expected text"),
    ("persistence = 2", "persistence = [2]", "rig.toml:22: monitor.alarms.dry_friction.persistence:"
     " found [2], expected a whole number"),
    ("[monitor]", "[monitor", "rig.toml:18: found a line that is not TOML (expected ']' at the end"
     " of a table declaration at column 9), expected `key = value` or `[section]`"),
    ("persistence = 2", "persistence = 2\npersistence = 3", "rig.toml:23: found a key that has a"
     " value already, expected each key once"),
    ("[monitor]", "[rig]\n[monitor]", "rig.toml:18: rig: found it a second time, expected all its"
     " keys in one place: one [section], one line of braces, or dotted keys"),
    ("persistence = 2", "persistence =", "rig.toml:22: found a line that is not TOML (invalid value"
     " at column 14), expected `key = value` or `[section]`"),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "said"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_a_mistake_is_named(right, wrong, said):
    with pytest.raises(ConfigError) as error:
        parse(GOOD.replace(right, wrong, 1), RigConfig, "rig.toml")
    assert str(error.value) == said


def test_a_good_configuration_is_read(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(GOOD)
    config = load_rig(path)
    assert config.daq.device.port == "/dev/ttyUSB0"
    assert config.monitor.alarms["dry_friction"].persistence == 2


def test_two_channels_of_one_name_are_refused(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(GOOD.replace('"position"', '"voltage"'))
    with pytest.raises(ConfigError, match="different names"):
        load_rig(path)


def silence(tmp_path, rate, device='adapter = "serial"\nport = "p"', daq="", witness=""):
    """The times without samples and without estimates that are alarms."""
    path = tmp_path / "rig.toml"
    channel = '[[channels]]\nname = "x"\nunit = "m"\ngain = 1.0\n'
    path.write_text(
        f'[rig]\nid = "r"\nsample_rate = {rate}\n{channel}[daq]\n{daq}\n[daq.device]\n{device}\n'
        f"[witness]\n{witness}\n"
    )
    config = load_rig(path)
    return config.stale_after, config.unwatched_after


@pytest.mark.parametrize(
    ("rate", "device", "least"),
    [
        (256.0, 'adapter = "serial"\nport = "p"', (0.1, 1.0)),
        (8.0, 'adapter = "serial"\nport = "p"', (0.375, 1.0)),
        (1.0, 'adapter = "serial"\nport = "p"', (3.0, 3.0)),
        (256.0, 'adapter = "modbus-tcp"\nhost = "h"\npolls = 4.0', (0.75, 1.0)),
        (256.0, 'adapter = "replay"\nsession = "s"\nspeed = 0.01', (1.171875, 1.171875)),
    ],
)
def test_silence_is_stale_after_three_periods_or_polls(tmp_path, rate, device, least):
    assert silence(tmp_path, rate, device) == pytest.approx(least)


def test_a_chosen_time_of_silence_holds_unless_it_is_less_than_two_periods(tmp_path):
    assert silence(tmp_path, 8.0, daq="stale_after = 0.25", witness="stale_after = 2.5") == (
        0.25,
        2.5,
    )
    with pytest.raises(ConfigError, match=r"daq\.stale_after: found 0\.2 s, expected at least 0"):
        silence(tmp_path, 8.0, daq="stale_after = 0.2")
    with pytest.raises(ConfigError, match=r"witness\.stale_after: found 0\.2 s"):
        silence(tmp_path, 8.0, witness="stale_after = 0.2")


def test_a_section_that_a_process_needs_is_asked_for():
    config = parse(GOOD, RigConfig, "rig.toml")
    with pytest.raises(ConfigError, match=r"a section \[recorder\]"):
        section_or_error(config, "recorder", "rig.toml")
    assert section_or_error(config, "monitor", "rig.toml") is config.monitor


@pytest.mark.parametrize("content", [b"[rig", b"\xff\xfe", b"id = 1\nid = 2"])
def test_a_file_that_is_no_toml_is_named(tmp_path, content):
    path = tmp_path / "rig.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"rig\.toml"):
        load(path, RigConfig)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"absent\.toml.*expected a readable file"):
        load(tmp_path / "absent.toml", RigConfig)
