"""The image, the compose file and the units: what they name exists, and what they run runs."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from rigwatch.commands import COMMANDS, main
from rigwatch.supervisor.plan import PROCESSES
from rigwatch.wire.rig_config import load_rig
from tools.image.collect import NUMBER, STATE

ROOT = Path(__file__).parents[2]
DOCKER = ROOT / "docker"
IN_CONTAINER = "/etc/rigwatch/rig.toml"
UNITS = sorted(path for path in (DOCKER / "systemd").rglob("*") if path.is_file())
RIGS = sorted(DOCKER.glob("*.toml"))


def instructions() -> list[tuple[str, str]]:
    """Instruction and arguments of each line of the Dockerfile, continued lines joined."""
    text = (DOCKER / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return [(head, rest.strip()) for head, _, rest in (line.partition(" ") for line in lines)]


def compose() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((DOCKER / "compose.yaml").read_text(encoding="utf-8"))
    return found


def services() -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = compose()["services"]
    return found


def unit_lines(unit: Path) -> list[tuple[str, str]]:
    lines = unit.read_text(encoding="utf-8").splitlines()
    pairs = (line.partition("=") for line in lines if "=" in line and not line.startswith("#"))
    return [(key, value) for key, _, value in pairs]


def parses(words: list[str]) -> bool:
    """Whether the command line is one that rigwatch understands, found out without running it."""
    with pytest.raises(SystemExit) as exit_:
        main([*words, "--help"])
    return exit_.value.code == 0


# The Dockerfile


def test_the_image_runs_as_a_user_without_rights_and_says_what_it_can_do() -> None:
    found = dict(instructions())
    assert found["USER"] not in ("root", "0")
    assert found["ENTRYPOINT"] == '["rigwatch"]'
    assert [rest for head, rest in instructions() if head == "USER"] == [found["USER"]]


def test_base_images_are_named_to_the_last_digit_and_run_a_supported_python() -> None:
    bases = [rest.split()[0] for head, rest in instructions() if head == "FROM"]
    build, run = bases
    assert re.fullmatch(r"python:3\.1[123]\.\d+-slim-\w+", build)
    assert run == "scratch", "what builds must not be in what runs, a shell least of all"


def test_what_runs_is_what_was_collected_and_its_state_belongs_to_its_user() -> None:
    last = instructions()[[head for head, _ in instructions()].index("FROM", 1) :]
    assert "RUN" not in [head for head, _ in last], "there is no shell to run it with"
    copied = [rest for head, rest in last if head == "COPY"]
    state = f"--from=build --chown={NUMBER}:{NUMBER} /state {STATE}"
    assert copied == ["--from=build /image /", state]
    environment = dict(re.findall(r"(\w+)=(\S+)", dict(last)["ENV"]))
    assert environment["PATH"] == "/opt/rigwatch/bin"


def test_only_locked_packages_get_into_the_image() -> None:
    installs = re.findall(r"pip install[^&]*", " ".join(rest for _, rest in instructions()))
    assert installs
    for install in installs:
        assert "--require-hashes" in install or "--no-index" in install, install


def test_layers_keep_no_caches_and_no_package_lists() -> None:
    for _, rest in instructions():
        assert "apt-get" not in rest or "rm -rf /var/lib/apt/lists" in rest
    assert any("PIP_NO_CACHE_DIR=1" in rest for head, rest in instructions() if head == "ENV")
    assert all(head not in ("ADD", "MAINTAINER") for head, _ in instructions())


def test_everything_that_is_copied_exists_and_is_let_into_the_build() -> None:
    allowed = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    for head, rest in instructions():
        if head == "COPY" and "--from" not in rest:
            for source in rest.split()[:-1]:
                assert (ROOT / source).exists(), source
                assert f"!{source}" in allowed or f"!{Path(source).parent}/*.txt" in allowed, source


# The compose file


@pytest.mark.parametrize("name", services())
def test_each_service_runs_a_command_of_rigwatch_on_a_mounted_configuration(name: str) -> None:
    command = services()[name]["command"]
    assert parses(command)
    mounted = [volume.rpartition(":ro")[0].rpartition(":")[2] for volume in mounts(name)]
    assert all(word in mounted for word in command if word.endswith(".toml"))


def mounts(name: str) -> list[str]:
    return [volume for volume in services()[name]["volumes"] if volume.endswith(":ro")]


def test_the_configurations_that_are_mounted_exist_and_are_right() -> None:
    text = (DOCKER / "compose.yaml").read_text(encoding="utf-8")
    named = set(re.findall(r"\./(\w+\.toml)", text))
    assert named == {rig.name for rig in RIGS}
    for rig in RIGS:
        config = load_rig(rig)
        if config.plant is not None:
            assert (ROOT / config.plant.scenario).is_file()


@pytest.mark.parametrize("name", services())
def test_each_lasting_service_has_a_health_check_that_can_be_run(name: str) -> None:
    service = services()[name]
    if service["restart"] != "unless-stopped":
        return
    kind, program, *words = service["healthcheck"]["test"]
    assert (kind, program) == ("CMD", "rigwatch")
    assert parses(words)


def test_all_processes_of_a_rig_have_a_service_and_none_has_rights_or_a_writable_image() -> None:
    run = {service["command"][0].replace("record", "recorder") for service in services().values()}
    assert set(PROCESSES) <= run
    for service in services().values():
        assert service["read_only"] is True
        assert service["cap_drop"] == ["ALL"]
        assert "privileged" not in service
        assert not service["image"].endswith(":latest")


def test_the_two_kinds_of_rig_differ_in_their_device_alone() -> None:
    profiles: dict[str, set[str]] = {"simulated": set(), "device": set()}
    for service in services().values():
        for profile in service.get("profiles", profiles):
            profiles[profile].add(service["command"][0])
    assert profiles["simulated"] - profiles["device"] == {"plant", "demo"}
    assert profiles["device"] - profiles["simulated"] == set()


@pytest.mark.skipif(not shutil.which("docker"), reason="no docker program here")
def test_compose_itself_understands_the_file() -> None:
    command = ["docker", "compose", "--file", str(DOCKER / "compose.yaml"), "config", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    if "unknown" in done.stderr or "is not a docker command" in done.stderr:
        pytest.skip("no docker compose here")
    assert done.returncode == 0, done.stderr


# The units


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.name)
def test_units_start_commands_of_rigwatch(unit: Path) -> None:
    for key, value in unit_lines(unit):
        if key in ("Wants", "PartOf"):
            for name in re.findall(r"rigwatch@(\w+)\.service", value):
                assert name in COMMANDS
        elif key == "ExecStart":
            program, command, config = value.split()
            assert program == "/opt/rigwatch/bin/rigwatch"
            assert command == "%i" or command in COMMANDS
            assert config == IN_CONTAINER


def test_services_have_a_watchdog_come_back_and_have_no_rights() -> None:
    for unit in DOCKER.glob("systemd/*.service"):
        settings = dict(unit_lines(unit))
        assert settings["Type"] == "notify"
        assert 0 < int(settings["WatchdogSec"]) <= 60
        assert settings["Restart"] == "always"
        assert settings["User"] == "rigwatch"
        for key in ("NoNewPrivileges", "ProtectHome", "PrivateTmp"):
            assert settings[key] == "yes"
        assert settings["ProtectSystem"] == "strict"
        assert settings["CapabilityBoundingSet"] == ""


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd here")
def test_systemd_understands_the_units(tmp_path: Path) -> None:
    for unit in UNITS:
        text = unit.read_text(encoding="utf-8")
        copy = tmp_path / unit.relative_to(DOCKER / "systemd")
        copy.parent.mkdir(exist_ok=True)
        copy.write_text(text.replace("/opt/rigwatch/bin/rigwatch", shutil.which("true") or ""))
    names = ["rigwatch.service", "rigwatch@daq.service", "rigwatch.target"]
    command = ["systemd-analyze", "verify", "--man=no", *(str(tmp_path / name) for name in names)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    said = [
        line for line in done.stderr.splitlines() if str(tmp_path) in line or "rigwatch" in line
    ]
    assert not [line for line in said if re.search(r"Unknown|Failed to parse|Invalid", line)], said
