"""Who may say that another device is the rig's: the account of the rig, or a proved operator."""

from pathlib import Path

import pytest

from daq.device_desk import DeviceDesk
from daq.known_device import KnownDevice
from rigwatch.keys import Authority
from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import DEVICE_KEY, Bus, DeviceRequest, accept_device, ask_for_device
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.rig_config import SecuritySection
from tests.access.rogue import kinds
from tests.access.secured_rig import make_keys, operator_bus

FIRST, OTHER = "RX-2, no. 4711", "RX-2, no. 4712"


class Site:
    """Data acquisition that refuses a device, on a bus in memory."""

    def __init__(self, security: SecuritySection, path: Path) -> None:
        self.network = MemoryNetwork()
        self.known = KnownDevice("daq/rig", path)
        self.known.admits(FIRST)
        self.known.admits(OTHER)
        self.desk = DeviceDesk(self.network.bus("bench", "daq"), self.known, security)

    def refused(self) -> float:
        return self.desk.counters["commands_refused"]


def asked(bus: Bus, user: str) -> str:
    return accept_device(bus, DeviceRequest(OTHER, user, "exchanged")).text


def test_with_keys_a_proved_operator_says_so_and_nobody_else(tmp_path: Path) -> None:
    keys = make_keys(tmp_path / "keys")
    site = Site(SecuritySection(keys=str(keys)), tmp_path / "device")
    ann, eve = operator_bus(site.network, keys, "ann"), site.network.bus("bench", "eve")
    assert "not signed" in asked(eve, "ann")
    assert "signed by ann, expected bob" in asked(ann, "bob")
    Authority(keys).revoke("bob")
    assert "revoked" in asked(operator_bus(site.network, keys, "bob"), "bob")
    assert (site.known.expected, site.refused()) == (FIRST, 3)
    state = ask_for_device(eve)
    assert (state.known, state.refused, state.answers) == (FIRST, True, OTHER)
    assert accept_device(ann, DeviceRequest(OTHER, "ann", "exchanged")).done
    assert site.known.admits(OTHER)
    assert "by ann (proved), exchanged" in site.known.events()[-1].text


def test_without_keys_the_account_of_the_rig_says_so(tmp_path: Path) -> None:
    own = SecuritySection(secret=str(tmp_path / "own"))
    foreign = SecuritySection(secret=str(tmp_path / "foreign"))
    site = Site(own, tmp_path / "device")
    (tmp_path / "foreign").write_text("0" * 64)
    (tmp_path / "foreign").chmod(0o600)
    stranger = site.network.bus("bench", "accept-1", signer_of(foreign, ""))
    assert "not signed with the secret" in asked(stranger, "ann")
    assert (site.known.expected, site.refused()) == (FIRST, 1)
    assert accept_device(
        site.network.bus("bench", "accept-2", signer_of(own, "")), DeviceRequest(OTHER, "ann", "")
    ).done
    assert "by ann (not proved)" in site.known.events()[-1].text


def test_a_device_that_has_been_put_back_is_not_accepted(tmp_path: Path) -> None:
    own = SecuritySection(secret=str(tmp_path / "own"))
    site = Site(own, tmp_path / "device")
    bus = site.network.bus("bench", "accept-1", signer_of(own, ""))
    site.known.admits(FIRST)
    assert "no device is refused" in asked(bus, "ann")
    assert not ask_for_device(bus).refused
    assert site.refused() == 0


@pytest.mark.parametrize("keyed", [True, False])
def test_no_made_up_request_changes_anything_and_each_is_counted(
    tmp_path: Path, *, keyed: bool
) -> None:
    keys = str(make_keys(tmp_path / "keys")) if keyed else ""
    site = Site(SecuritySection(keys=keys, secret=str(tmp_path / "own")), tmp_path / "device")
    eve = site.network.bus("bench", "eve")
    messages = [one for one in kinds() if one]
    for message in messages:
        assert eve.query(DEVICE_KEY, message)
    assert site.refused() == len(messages)
    assert (site.known.expected, site.known.refused) == (FIRST, OTHER)
