"""Access control: mutual TLS, and the topics allowed for each role; everything else is denied.

The router admits certificates by common name if the register of its keys folder lists them as
valid. Every role may subscribe to the rig's topics; the topics it may publish are in `_SAYS`.
"""

from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.errors import ConfigError, KeysError
from rigwatch.wire.host import endpoint_address
from rigwatch.wire.messages import (
    ALARMS,
    ALIVE_KEY,
    COMMANDS,
    ESTIMATES,
    EVENTS,
    GAPS,
    HEALTH,
    MODELS,
    RING_KEY,
    RUN,
    SAMPLES,
)  # fmt: skip
from rigwatch.wire.rig_config import BusSection

REGISTER = "register.json"
ROLES = ("router", "device", "daq", "monitor", "recorder", "witness", "dashboard", "operator")
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_EVERYBODY = (EVENTS.key, GAPS.key, HEALTH.key)
_SAYS: dict[str, tuple[str, ...]] = {
    "device": (),
    "daq": (SAMPLES.key,),
    "monitor": (ALARMS.key, ESTIMATES.key, MODELS.key),
    "recorder": (RUN.key,),
    "witness": (ALARMS.key,),
    "dashboard": (),
    "operator": (COMMANDS.key,),
}
_ANSWERS = {
    "daq": (RING_KEY,),
    "monitor": ("ring/**", "monitor/standing", "monitor/model"),
    "witness": ("ring/witness/**", "monitor/standing"),
}
_TOKENS = {"daq": ("source/**",), "monitor": ("said/**",), "witness": ("said/witness/**",)}
_ASKS = {"operator": ("monitor/model",)}
_EVERYBODY_ASKS = (RING_KEY, "ring/**", "monitor/standing")


class Issued(msgspec.Struct, frozen=True):
    """A certificate: owner, role, serial number, expiry date, and whether it is revoked."""

    name: str
    role: str
    serial: int
    ends: str
    revoked: bool = False

    @property
    def common_name(self) -> str:
        """The certificate's unique common name."""
        return f"{self.name}.{self.serial}"


class Register(msgspec.Struct, frozen=True):
    """The certificates issued by a rig's authority."""

    rig: str
    issued: tuple[Issued, ...]


def authority_file(folder: Path) -> Path:
    """The authority's certificate."""
    return folder / "authority.pem"


def key_files(folder: Path, name: str) -> tuple[Path, Path]:
    """Paths of the certificate and the private key of a name."""
    return folder / f"{name}.pem", folder / f"{name}.key"


def check_exposure(bus: BusSection) -> None:
    """Refuse a router that is reachable from a network without authentication.

    Raises:
        ConfigError: `bus.listen` is not a loopback address and there are no keys.
    """
    address = endpoint_address(bus.listen)
    local = address is not None and address[0] in _LOOPBACK
    if bus.security.keys and not bus.listen.startswith("tls/"):
        raise ConfigError("configuration", "bus.listen", bus.listen, "tls/… where there are keys")
    if local or bus.security.keys or bus.security.isolated_network:
        return
    expected = "a loopback address, or keys in bus.security.keys (`rigwatch keys new`)"
    raise ConfigError("configuration", "bus.listen", f"{bus.listen} without keys", expected)


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
    side = "listen" if listens else "connect"
    return {
        "transport/link/tls/root_ca_certificate": str(authority_file(folder)),
        f"transport/link/tls/{side}_certificate": str(public),
        f"transport/link/tls/{side}_private_key": str(private),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": True,
    }


def access_settings(bus: BusSection, rig: str) -> dict[str, Any]:
    """The router's access settings; none without keys.

    Raises:
        KeysError: the register cannot be read.
    """
    if not bus.security.keys:
        return {}
    path = Path(bus.security.keys) / REGISTER
    try:
        register = msgspec.json.decode(path.read_bytes(), type=Register)
    except (OSError, msgspec.MsgspecError) as error:
        raise KeysError(f"{path}: cannot be read: {error}") from None
    return {"access_control": access_list(register, rig)}


def access_list(register: Register, rig: str) -> dict[str, Any]:
    """Zenoh's access control list; everything not listed is denied."""
    valid = [one for one in register.issued if not one.revoked]
    rules, subjects, policies = [_listening(rig)], [], []
    for role in _SAYS:
        names = [one.common_name for one in valid if one.role == role]
        if not names:
            continue
        own = _role_rules(role, rig)
        rules += own
        subjects.append({"id": role, "cert_common_names": names})
        policies.append({"rules": ["listen", *(rule["id"] for rule in own)], "subjects": [role]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _role_rules(role: str, rig: str) -> list[dict[str, Any]]:
    """Rules for what a client of this role may send to the router."""
    said = (*_EVERYBODY, *_SAYS[role])
    asked = (*_EVERYBODY_ASKS, *_ASKS.get(role, ()))
    tokens = (f"{ALIVE_KEY}/**", *_TOKENS.get(role, ()))
    rules = [
        _rule(f"{role} says", ["put"], rig, said),
        _rule(f"{role} asks", ["query"], rig, asked),
        _rule(f"{role} is alive", ["liveliness_token"], rig, tokens),
        _rule(
            f"{role} looks",
            ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"],
            rig,
            ("**",),
        ),
    ]
    if answered := _ANSWERS.get(role):
        rules.append(_rule(f"{role} answers", ["declare_queryable", "reply"], rig, answered))
    return rules


def _listening(rig: str) -> dict[str, Any]:
    """Rules for what the router may send to any client."""
    everything = [
        "put", "delete", "query", "reply", "declare_subscriber", "declare_queryable",
        "liveliness_token", "liveliness_query", "declare_liveliness_subscriber",
    ]  # fmt: skip
    return _rule("listen", everything, rig, ("**",)) | {"flows": ["egress"]}


def _rule(name: str, messages: list[str], rig: str, keys: tuple[str, ...]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": ["ingress"],
        "messages": messages,
        "key_exprs": [f"rig/{rig}/{key}" for key in keys],
    }
