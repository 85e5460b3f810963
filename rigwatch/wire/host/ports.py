"""Checks whether a TCP port of this machine is free, before a process uses it."""

import contextlib
import socket


def endpoint_address(endpoint: str) -> tuple[str, int] | None:
    """Host and port of a bus endpoint such as "tcp/127.0.0.1:7447"; None for other protocols."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.partition("?")[0].rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdigit():
        return None
    return host.strip("[]"), int(port)


def is_free(host: str, port: int) -> bool:
    """Whether a server can listen there now."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError:
            return False
    return True


def free_port(host: str = "127.0.0.1") -> int:
    """A currently free port."""
    return free_ports(1, host)[0]


def free_ports(count: int, host: str = "127.0.0.1") -> list[int]:
    """Currently free ports, no two the same."""
    with contextlib.ExitStack() as held:
        probes = [held.enter_context(socket.socket()) for _ in range(count)]
        for probe in probes:
            probe.bind((host, 0))
        return [int(probe.getsockname()[1]) for probe in probes]
