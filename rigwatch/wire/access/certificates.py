"""The certificates that processes use: mutual TLS of the bus, and who the operator is."""

import getpass
import os
from pathlib import Path
from typing import Any

from rigwatch.wire.access.register import ROLES, authority_file, key_files
from rigwatch.wire.errors import ConfigError, KeysError
from rigwatch.wire.host import endpoint_address
from rigwatch.wire.rig_config import BusSection

_LOOPBACK = ("127.0.0.1", "::1", "localhost")


def check_exposure(bus: BusSection) -> None:
    """Refuse a router that is reachable from a network, or reaches out, without authentication.

    Raises:
        ConfigError: `bus.listen` or one of `bus.links` is not a loopback address and there are no
            keys.
    """
    for key, endpoint in [("bus.listen", bus.listen), *(("bus.links", one) for one in bus.links)]:
        _check_endpoint(bus, key, endpoint)


def _check_endpoint(bus: BusSection, key: str, endpoint: str) -> None:
    address = endpoint_address(endpoint)
    local = address is not None and address[0] in _LOOPBACK
    if bus.security.keys and not endpoint.startswith("tls/"):
        raise ConfigError("configuration", key, endpoint, "tls/… where there are keys")
    if local or bus.security.keys or bus.security.isolated_network:
        return
    expected = "a loopback address, or keys in bus.security.keys (`rigwatch keys new`)"
    raise ConfigError("configuration", key, f"{endpoint} without keys", expected)


def certificate_name(bus: BusSection, process: str) -> str:
    """The certificate name of a process: its own, otherwise that of this machine's operator."""
    names = {"structure": "monitor"} | {name: name for name in ROLES}
    return names.get(process, bus.security.operator)


def tls_settings(bus: BusSection, name: str, *, listens: bool = False) -> dict[str, Any]:
    """Zenoh's settings for a process with the certificate of `name`; none without keys.

    Raises:
        KeysError: a file is missing.
    """
    if not bus.security.keys:
        return {}
    folder = Path(bus.security.keys)
    public, private = key_files(folder, name)
    for path in (authority_file(folder), public, private):
        if not path.is_file():
            raise KeysError(f"{path}: no such file; `rigwatch keys issue {name}` makes it")
        if not os.access(path, os.R_OK):
            raise KeysError(f"{path}: this account may not read it, expected to")
    side = "listen" if listens else "connect"
    return {
        "transport/link/tls/root_ca_certificate": str(authority_file(folder)),
        f"transport/link/tls/{side}_certificate": str(public),
        f"transport/link/tls/{side}_private_key": str(private),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": True,
    }


def operator_name(bus: BusSection, given: str = "") -> str:
    """The user of commands sent from this machine.

    Args:
        bus: section [bus].
        given: name asked for; empty for the certificate's, without keys the login name.

    Raises:
        KeysError: the rig has keys and `given` is not the certificate's name.
    """
    if not bus.security.keys:
        return given or getpass.getuser()
    own = bus.security.operator
    if given not in ("", own):
        raise KeysError(
            f"user: found {given}, expected {own}, whose certificate commands on this machine use "
            "(bus.security.operator)"
        )
    return own
