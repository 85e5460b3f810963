"""What the containers of the simulated rig would run, run here: every command and health check."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from shutil import copy
from typing import Any

import pytest
import yaml

from rigwatch.commands import main
from rigwatch.wire.host.ports import free_port
from tests.waiting import eventually

ROOT = Path(__file__).parents[2]
STATE, MOUNTED = "/var/lib/rigwatch", "/etc/rigwatch/rig.toml"

pytestmark = [pytest.mark.xdist_group("rig"), pytest.mark.long]


def simulated_services() -> dict[str, dict[str, Any]]:
    text = (ROOT / "docker" / "compose.yaml").read_text(encoding="utf-8")
    services = yaml.safe_load(text)["services"]
    return {n: s for n, s in services.items() if "simulated" in s.get("profiles", ["simulated"])}


class Host:
    """This machine in place of a container host: same commands, its own folders and ports."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        (folder / "state").mkdir()
        text = (ROOT / "docker" / "simulated.toml").read_text(encoding="utf-8")
        device, bus = str(free_port()), f'"tcp/127.0.0.1:{free_port()}"'
        text = text.replace("5020", device).replace(STATE, str(folder / "state"))
        text = text.replace('id = "simulated"', f'id = "simulated-{device}"')
        ports = f"grpc_port = {free_port()}\nweb_port = {free_port()}\n"
        text = text.replace('viewer = "web"\n', f'viewer = "web"\n{ports}')
        text += f"\n[bus]\nrouter = {bus}\nlisten = {bus}\n"
        (folder / "rig.toml").write_text(text)

    def words(self, words: list[str]) -> list[str]:
        here = {STATE: str(self.folder / "state"), MOUNTED: str(self.folder / "rig.toml")}
        return [here.get(word, word) for word in words]

    def command(self, words: list[str]) -> list[str]:
        return [sys.executable, "-m", "rigwatch", *self.words(words)]

    def log(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text()

    def is_well(self, name: str, check: list[str]) -> None:
        """Wait until the health check of a service finds it well, then run the check itself.

        Most looks come too early: they are taken in this process, which costs no start of another.
        """

        def well() -> bool:
            assert self.running[name].poll() is None, f"{name} ended: {self.log(name)}"
            return main(self.words(check)) == 0

        eventually(well, f"{name} is well")
        done = self.run(check, timeout=30)
        assert done.returncode == 0, f"{done.stdout}{done.stderr}{self.log(name)}"

    def run(self, words: list[str], timeout: float) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            self.command(words),
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
        )

    def start(self, name: str, words: list[str]) -> None:
        with (self.folder / f"{name}.log").open("wb") as log:
            self.running[name] = subprocess.Popen(
                self.command(words), cwd=ROOT, stdout=log, stderr=subprocess.STDOUT
            )

    def stop(self) -> dict[str, int]:
        for process in reversed(self.running.values()):
            process.terminate()
        return {name: process.wait(timeout=30) for name, process in self.running.items()}


@pytest.fixture
def host(tmp_path: Path) -> Iterator[Host]:
    place = Host(tmp_path)
    yield place
    for process in place.running.values():
        process.kill()
        process.wait()


@pytest.mark.parametrize("model", ["kept", pytest.param("made", marks=pytest.mark.nightly)])
def test_every_service_runs_and_passes_its_own_health_check_and_stops_when_asked(
    host: Host, model: str
) -> None:
    services = simulated_services()
    lasting = {n: s for n, s in services.items() if s["restart"] == "unless-stopped"}
    if model == "kept":
        # What the other services make: the demo of `make test` is commissioned by that command too.
        copy(ROOT / "tests" / "verify" / "model.toml", host.folder / "state")
    else:
        for name in services.keys() - lasting.keys():
            done = host.run(services[name]["command"], timeout=120)
            assert done.returncode == 0, done.stderr
    for name, service in lasting.items():
        host.start(name, service["command"])
    for name, service in lasting.items():
        host.is_well(name, service["healthcheck"]["test"][2:])
    assert set(host.stop().values()) == {0}
    assert list((host.folder / "state" / "sessions").glob("*/*.mcap"))


def test_a_health_check_fails_for_a_process_that_is_not_there(host: Host) -> None:
    for name in ("router", "plant", "daq"):
        done = host.run(["doctor", MOUNTED, "--alive", name], timeout=30)
        assert done.returncode == 1
        assert done.stdout.startswith("fail")
