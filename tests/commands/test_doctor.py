"""`rigwatch doctor`: what is wrong is said in one line, with what to do."""

import json
import socket
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.doctor.machine import check_disk, check_kernels, check_machine
from rigwatch.doctor.rig import check_rig, check_serial
from rigwatch.wire.host.ports import endpoint_address, free_port, free_ports, is_free
from tests.access.secured_rig import make_keys

RIG = """
[rig]
id = "bench"
[[channels]]
name = "voltage"
unit = "V"
gain = 0.001
[daq.device]
adapter = "serial"
port = "{port}"
[bus]
listen = "{scheme}/127.0.0.1:{bus}"
{more}
"""


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield int(server.getsockname()[1])


def levels(
    tmp_path: Path, port: str = "/dev/null", bus: int = 0, more: str = "", scheme: str = "tcp"
) -> dict[str, str]:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.format(port=port, bus=bus or free_port(), more=more, scheme=scheme))
    return {finding.what: finding.level for finding in check_rig(path)}


def test_this_machine_can_run_the_tests() -> None:
    assert not [f for f in check_machine(Path()) if f.level == "fail"]


def test_a_good_configuration_has_nothing_to_complain_about(tmp_path: Path) -> None:
    assert set(levels(tmp_path).values()) == {"ok"}


def test_thinning_needs_the_packages_of_an_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    more = "[recorder]\nsession_days = 1\nthin_days = 30"
    assert levels(tmp_path, more=more)["thinning"] == "ok"
    monkeypatch.setitem(sys.modules, "pyarrow", None)  # as if it were not installed
    assert levels(tmp_path, more=more)["thinning"] == "fail"


def test_a_misspelt_key_is_named_and_nothing_else_is_guessed(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(
        RIG.format(port="/dev/null", bus=7447, scheme="tcp", more="[monitr]\nmodel = 'm.toml'")
    )
    (finding,) = check_rig(path)
    assert finding.level == "fail"
    assert "monitr" in finding.text
    assert str(path) in finding.text


def test_a_port_in_use_a_missing_model_and_a_missing_device_are_found(
    tmp_path: Path, taken_port: int
) -> None:
    more = '[monitor]\nmodel = "no-such-model.toml"'
    found = levels(tmp_path, port=str(tmp_path / "tty*"), bus=taken_port, more=more)
    assert found["bus.listen"] == "warn"
    assert found["model"] == "fail"
    assert found["device"] == "fail"


def test_two_lines_for_one_pattern_are_no_answer(tmp_path: Path) -> None:
    for name in ("tty0", "tty1"):
        (tmp_path / name).touch()
    finding = check_serial(str(tmp_path / "tty?"))
    assert finding.level == "fail"
    assert "tty0" in finding.text
    assert "tty1" in finding.text


def test_a_folder_that_does_not_exist_yet_is_judged_by_its_disk(tmp_path: Path) -> None:
    assert "free" in check_disk(tmp_path / "not" / "yet").text


def test_kernels_compile_and_are_kept() -> None:
    finding = check_kernels()
    assert finding.level == "ok", finding.text


def test_json_and_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("[rig]\n")
    assert main(["doctor", str(path), "--json"]) == 1
    findings = json.loads(capsys.readouterr().out)
    assert {"what", "level", "text", "remedy"} == set(findings[0])
    assert findings[-1]["what"] == "configuration"


@pytest.mark.parametrize(
    ("endpoint", "address"),
    [
        ("tcp/127.0.0.1:7447", ("127.0.0.1", 7447)),
        ("tls/[::1]:7447", ("::1", 7447)),
        ("tcp/0.0.0.0:1?so=1", ("0.0.0.0", 1)),
        ("unixsock-stream/place", None),
    ],
)
def test_endpoints_are_taken_apart(endpoint: str, address: tuple[str, int] | None) -> None:
    assert endpoint_address(endpoint) == address


def test_free_and_taken_ports_are_distinguished(taken_port: int) -> None:
    assert not is_free("127.0.0.1", taken_port)
    assert is_free("127.0.0.1", free_port())
    assert len(set(free_ports(200))) == 200


def test_certificates_that_end_and_keys_that_others_read_are_found(tmp_path: Path) -> None:
    keys = make_keys(tmp_path / "keys")
    more = f'router = "tls/127.0.0.1:1"\n[bus.security]\nkeys = "{keys}"\noperator = "ann"'
    assert set(levels(tmp_path, more=more, scheme="tls").values()) == {"ok"}
    for days, level in ((20, "warn"), (-1, "fail")):
        _end_in(keys, days)
        (keys / "daq.key").chmod(0o640)
        found = levels(tmp_path, more=more, scheme="tls")
        assert (found["keys"], found["private keys"]) == (level, "fail")
    (keys / "register.json").unlink()
    assert levels(tmp_path, more=more, scheme="tls")["keys"] == "fail"


def _end_in(keys: Path, days: int) -> None:
    """The certificate of daq ends in so many days."""
    register = json.loads((keys / "register.json").read_text())
    for one in register["issued"]:
        if one["name"] == "daq":
            one["ends"] = (datetime.now(UTC) + timedelta(days=days)).strftime("%Y-%m-%d")
    (keys / "register.json").write_text(json.dumps(register))
