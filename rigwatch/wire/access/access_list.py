"""Access control: the topics allowed for each role; everything else is denied.

The router admits certificates by common name if the register of its keys folder lists them as
valid. Every role may subscribe to the rig's topics; the topics it may publish are in `_SAYS`.
"""

from pathlib import Path
from typing import Any

from rigwatch.wire.access.register import Register, read_register
from rigwatch.wire.messages import (
    ALARMS,
    ALIVE_KEY,
    COMMANDS,
    ESTIMATES,
    EVENTS,
    GAPS,
    HEALTH,
    MODELS,
    PAST_KEY,
    RING_KEY,
    RUN,
    SAMPLES,
)  # fmt: skip
from rigwatch.wire.rig_config import BusSection

_EVERYBODY = (EVENTS.key, GAPS.key, HEALTH.key)
_SAYS: dict[str, tuple[str, ...]] = {
    "router": (),
    "device": (),
    "daq": (SAMPLES.key, HEALTH.key_of("daq")),
    "monitor": (ALARMS.key, ESTIMATES.key, MODELS.key),
    "recorder": (RUN.key, HEALTH.key_of("recorder"), GAPS.key_of("recorder")),
    "witness": (ALARMS.key,),
    "dashboard": (),
    "operator": (COMMANDS.key,),
}
_ANSWERS = {
    "daq": (RING_KEY, "daq/device", "daq/receiver"),
    "recorder": (PAST_KEY,),
    "monitor": (
        "ring/**",
        "monitor/standing",
        "monitor/shelf",
        "monitor/receiver",
        "monitor/model",
    ),
    "witness": ("ring/witness/**", "monitor/standing", "monitor/receiver"),
}
_TOKENS = {"daq": ("source/*",), "monitor": ("said/**",), "witness": ("said/witness/*",)}
"""Tokens with names, which their holder also sends and answers with."""
_ASKS = {"operator": ("monitor/receiver", "monitor/model", "daq/device", "daq/receiver", PAST_KEY)}
"""The recorder of a headquarters has the certificate of an operator."""
_EVERYBODY_ASKS = (
    RING_KEY, "ring/**", "monitor/standing", "monitor/shelf", "source/*", "said/**",
)  # fmt: skip

LINKED = "router"
"""The role of routers, also of those of other sites."""
_MESSAGES = [
    "put", "delete", "query", "reply", "declare_subscriber", "declare_queryable",
    "liveliness_token", "liveliness_query", "declare_liveliness_subscriber",
]  # fmt: skip


def alarm_roles() -> tuple[str, ...]:
    """The processes of a rig that say alarms."""
    return tuple(role for role, keys in _SAYS.items() if ALARMS.key in keys)


def access_settings(bus: BusSection, rig: str) -> dict[str, Any]:
    """The router's access settings; none without keys.

    Raises:
        KeysError: the register cannot be read.
    """
    if not bus.security.keys:
        return {}
    return {"access_control": access_list(read_register(Path(bus.security.keys)), rig)}


def access_list(register: Register, rig: str) -> dict[str, Any]:
    """Zenoh's access control list; everything not listed is denied."""
    valid = [one for one in register.issued if not one.revoked]
    rules, subjects, policies = [_listening(rig)], [], []
    for role in _SAYS:
        names = [one.common_name for one in valid if one.role == role]
        if not names:
            continue
        own = _linked(rig) if role == LINKED else _role_rules(role, rig)
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
    named = _TOKENS.get(role, ())
    said = (*_EVERYBODY, *_SAYS[role], *named)
    asked = (*_EVERYBODY_ASKS, *_ASKS.get(role, ()))
    tokens = (f"{ALIVE_KEY}/**", *named)
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
    others = tuple(f"{ALIVE_KEY}/{process}" for process in HEALTH.owned_by if process != role)
    feigned = _rule(f"{role} is no other", ["liveliness_token"], rig, others)
    rules.append(feigned | {"permission": "deny"})
    if answered := (*_ANSWERS.get(role, ()), *named):
        rules.append(_rule(f"{role} answers", ["declare_queryable", "reply"], rig, answered))
    return rules


def _linked(rig: str) -> list[dict[str, Any]]:
    """A router of another site speaks for the processes behind it, which it has checked."""
    return [_rule("router links", _MESSAGES, rig, ("**",))]


def _listening(rig: str) -> dict[str, Any]:
    """Rules for what the router may send to any client."""
    return _rule("listen", _MESSAGES, rig, ("**",)) | {"flows": ["egress"]}


def _rule(name: str, messages: list[str], rig: str, keys: tuple[str, ...]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": ["ingress"],
        "messages": messages,
        "key_exprs": [f"rig/{rig}/{key}" for key in keys],
    }
