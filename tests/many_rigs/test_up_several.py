"""`rigwatch up` of several rigs: overlays over one base, one daq, monitor and recorder."""

import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.supervisor import plan_several
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import HEALTH
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from rigwatch.wire.several_rigs import valid_rigs
from rigwatch.wire.typed_files import loads
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.bus.rig import CONFIG, TestRig, free_port
from tests.daq.rig import ToySource, in_thread
from tests.monitor_process.model import monitor_section
from tests.monitor_process.test_real_process import Judged
from tests.tooling.test_up import Rig
from tests.waiting import PATIENCE, eventually

pytestmark = pytest.mark.xdist_group("many-rigs")
NAMES = ("one", "two")


def write_rigs(folder: Path) -> list[Path]:
    """A base and a small overlay for each rig."""
    port = free_port()
    base = CONFIG.format(router=port, listen=port, lease=10.0).replace('id = "bench"', 'id = "?"')
    recorder = f'[recorder]\nfolder = "{folder / "sessions"}"\nflush = 0.1\n[dashboard]\n'
    (folder / "base.toml").write_text(base + monitor_section(folder) + recorder)
    (folder / "rigs").mkdir()
    paths = [folder / "rigs" / f"{name}.toml" for name in NAMES]
    for path in paths:
        path.write_text(
            f'base = "../base.toml"\n[rig]\nid = "{path.stem}"\n'
            f'[daq.device]\nport = "{folder / path.stem}"\n'
            f'[monitor]\njournal = "{folder / path.stem}.jsonl"\n'
        )
    return paths


class Fleet:
    """Two rigs and a file that is wrong, under one `rigwatch up`; what is judged of each rig."""

    def __init__(self, folder: Path, held: ExitStack) -> None:
        self.folder, self.paths = folder, write_rigs(folder)
        self.devices = {}
        for name in NAMES:
            server = SerialServer(Device(ToySource()), PtyLine(folder / name))
            self.devices[name] = server.device
            held.enter_context(in_thread(server.run))
        wrong = folder / "rigs" / "wrong.toml"
        wrong.write_text('base = "../base.toml"\n[rig]\nid = "x"\n[rgi]\n')
        self.up = Rig(self.paths[0], str(self.paths[1]), str(wrong))
        held.callback(self.end)
        self.base = held.enter_context(TestRig(folder))
        configs = {name: load_rig(path) for name, path in zip(NAMES, self.paths, strict=True)}
        self.up.wait_for("ready", PATIENCE, process="monitor")
        buses = {name: self.base.bus("observer", config) for name, config in configs.items()}
        self.judged = {name: Judged(bus) for name, bus in buses.items()}
        self.health = {name: bus.subscribe(HEALTH) for name, bus in buses.items()}

    def end(self) -> None:
        if self.up.process.poll() is None:
            self.up.process.send_signal(signal.SIGTERM)
            self.up.process.wait(timeout=PATIENCE)

    def go_on(self, name: str, samples: int = 128) -> None:
        boot, judged = self.devices[name].boot, self.judged[name]
        judged.reaches(boot, judged.last(boot) + samples)

    def processes(self) -> dict[str, dict]:
        return dict(self.up.wait_for("status", PATIENCE)["processes"])


@pytest.fixture(scope="module")
def fleet(tmp_path_factory) -> Iterator[Fleet]:
    with ExitStack() as held:
        yield Fleet(tmp_path_factory.mktemp("fleet"), held)


def test_one_process_each_serves_all_rigs_and_a_wrong_file_is_left_out(fleet):
    for name in NAMES:
        fleet.go_on(name)
    assert set(fleet.processes()) == {"router", "daq", "monitor", "recorder"}
    said = [event["text"] for event in fleet.up.events if event.get("process") == "up"]
    assert (
        "wrong.toml:4: rgi: found an unknown key, expected 'rig'; this rig is left out" in said[0]
    )
    assert "no dashboard for several rigs" in said[1]


def test_a_change_of_one_rig_interrupts_no_other(fleet):
    for name in NAMES:
        fleet.go_on(name)
    before, first = fleet.processes(), fleet.judged["one"].last(fleet.devices["one"].boot)
    two = fleet.paths[1]
    two.write_text(two.read_text().replace("[daq.device]", "[daq]\nname = 'renewed'\n[daq.device]"))
    told = fleet.up.wait_for("changed", PATIENCE)["text"]
    assert told.endswith("two.toml has changed; started anew: daq, recorder")
    eventually(
        lambda: any(one.source == "daq/renewed" for one in fleet.health["two"].drain()),
        "the rig runs as it is configured now",
    )
    fleet.go_on("one")
    boot, judged = fleet.devices["one"].boot, fleet.judged["one"]
    assert set(range(first, judged.last(boot))) <= judged.numbers[boot]
    assert fleet.processes()["daq"]["pid"] == before["daq"]["pid"]


def test_a_mistake_in_the_base_is_named_and_all_goes_on(fleet):
    base = fleet.folder / "base.toml"
    text = base.read_text()
    base.write_text(text.replace("lease = 10.0", "lease = -1.0"))
    told = fleet.up.wait_for("changed", PATIENCE)["text"]
    assert "base.toml:8: bus.lease: found -1.0" in told
    for name in NAMES:
        fleet.go_on(name)
    base.write_text(text)


@pytest.mark.nightly
def test_at_its_end_the_sessions_carry_the_whole_configuration(fleet):
    for name in NAMES:
        fleet.go_on(name)
    fleet.end()
    assert fleet.up.process.returncode == 0
    for name in NAMES:
        folder = max((fleet.folder / "sessions").glob(f"{name}-*"))
        session = open_session(folder)
        found = loads(session.info.configuration)
        assert (session.info.rig, found["rig"]["id"]) == (name, name)
        assert found["channels"][0]["name"] == "voltage"
        assert sum(map(len, session.samples())) > 0


def test_rigs_with_keys_need_routers_of_their_own(tmp_path):
    paths = write_rigs(tmp_path)
    names = [one.name for one in plan_several(valid_rigs(paths))]
    assert names == ["router", "daq", "monitor", "recorder"]
    base = tmp_path / "base.toml"
    base.write_text(base.read_text() + '[bus.security]\nkeys = "keys"\n')
    with pytest.raises(ConfigError, match=r"two.toml: bus.listen: found the address of .*one.toml"):
        plan_several(valid_rigs(paths))
    other = f'[bus]\nlisten = "tcp/127.0.0.1:{free_port()}"\n'
    paths[1].write_text(paths[1].read_text() + other)
    names = [one.name for one in plan_several(valid_rigs(paths), ["recorder"])]
    assert names == ["router one", "router two", "daq", "monitor"]


def test_two_configurations_of_one_rig_or_only_wrong_ones_are_refused(tmp_path, capsys):
    paths = write_rigs(tmp_path)
    paths[1].write_text(paths[0].read_text())
    assert main(["up", *map(str, paths)]) == 2
    assert "rig.id: found the same as in " in capsys.readouterr().err
    for path in paths:
        path.write_text("[rgi]\n")
    assert main(["up", *map(str, paths)]) == 2
    assert "rgi: found an unknown key" in capsys.readouterr().err
