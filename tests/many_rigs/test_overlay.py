"""A configuration over a base: the overlay wins key by key, errors name the file with the key."""

from pathlib import Path

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import SerialSection, load_rig, rig_text
from rigwatch.wire.typed_files import loads
from tests.bus.rig import CONFIG

OWN = 'base = "../base.toml"\n[rig]\nid = "seven"\n'


@pytest.fixture
def base(tmp_path: Path) -> Path:
    path = tmp_path / "base.toml"
    path.write_text(CONFIG.format(router=7447, listen=7447, lease=3.0))
    return path


@pytest.fixture
def overlay(base: Path):
    """Writes an overlay in a folder beside the base."""
    folder = base.parent / "rigs"
    folder.mkdir()

    def write(text: str, name: str = "seven.toml") -> Path:
        (folder / name).write_text(text)
        return folder / name

    return write


def refusal(path: Path) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    return caught.value


def test_the_overlay_wins_key_by_key(base, overlay):
    text = f'{OWN}[[channels]]\nname = "position"\ngain = 0.5\n[daq.device]\nport = "/dev/seven"\n'
    config, below = load_rig(overlay(text)), load_rig(base)
    assert config.rig.id == "seven"
    assert config.bus == below.bus
    assert config.daq.device == SerialSection(port="/dev/seven")
    assert [(c.name, c.unit, c.gain) for c in config.channels] == [
        ("voltage", "V", 0.001),
        ("position", "m", 0.5),
        ("acceleration", "m/s^2", 0.001),
    ]


def test_a_device_of_another_kind_replaces_that_of_the_base(overlay):
    device = '[daq.device]\nadapter = "modbus-tcp"\nhost = "plc7"\n'
    config = load_rig(overlay(OWN + device))
    assert vars_of(config.daq.device)["host"] == "plc7"


def vars_of(section) -> dict[str, object]:
    return {name: getattr(section, name) for name in section.__struct_fields__}


def test_bases_have_bases_and_the_text_of_all_is_that_of_one_file(base, overlay):
    overlay('base = "../base.toml"\n[bus]\nlease = 5.0\n', "hall.toml")
    path = overlay(OWN.replace("../base", "hall"))
    config = load_rig(path)
    assert (config.rig.id, config.bus.lease, config.bus.router) == (
        "seven",
        5.0,
        "tcp/127.0.0.1:7447",
    )
    alone = overlay(rig_text(path), "alone.toml")
    assert vars_of(load_rig(alone)) | {"base": ""} == vars_of(config) | {"base": ""}
    assert "base" not in loads(rig_text(path))
    assert rig_text(base) == base.read_text()


@pytest.mark.parametrize(
    ("own", "below", "place"),
    [
        ("", ("lease = 3.0", 'lease = "x"'), ("base.toml", "bus.lease", 8)),
        ("[bus]\nlease = -1.0\n", ("", ""), ("seven.toml", "bus.lease", 5)),
        ("[bus]\nlaese = 1.0\n", ("", ""), ("seven.toml", "bus.laese", 5)),
        ("", ("lease = 3.0", "laese = 3.0"), ("base.toml", "bus.laese", 8)),
        (
            '[[channels]]\nname = "acceleration"\ngain = "x"\n',
            ("", ""),
            ("seven.toml", "channels[0].gain", 6),
        ),
        (
            '[[channels]]\nname = "position"\ngain = 2.0\n',
            ('unit = "m/s^2"', "unit = 1"),
            ("base.toml", "channels[2].unit", 22),
        ),
        (
            '[[channels]]\nname = "force"\ngain = 1.0\n',
            ("", ""),
            ("seven.toml", "channels[0].unit", 4),
        ),
    ],
)
def test_an_error_names_the_file_that_holds_the_key(base, overlay, own, below, place):
    base.write_text(base.read_text().replace(*below))
    error = refusal(overlay(OWN + own))
    assert (Path(error.file).name, error.key, error.line) == place


def test_a_base_that_is_wrong_is_named(base, overlay):
    error = refusal(overlay('base = "no.toml"\n'))
    assert (error.key, error.line) == ("base", 1)
    assert "there is no" in str(error)
    assert "a file that does not lead back" in str(refusal(overlay('base = "seven.toml"\n')))
    assert "the path of a file" in str(refusal(overlay("base = 3\n")))
    long = refusal(overlay(f'base = "{"x" * 300}.toml"\n'))
    assert (long.key, "file name too long" in str(long)) == ("base", True)
    base.write_text("[rig\n")
    assert Path(refusal(overlay(OWN)).file).name == "base.toml"


def test_two_channels_of_one_name_are_those_of_the_base(base, overlay):
    base.write_text(base.read_text().replace('"position"', '"voltage"'))
    assert Path(refusal(overlay(OWN)).file).name == "base.toml"
